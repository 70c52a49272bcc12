mod device_failures;
mod gpu_gather;
mod gpu_rows;

mod cpu_gather;
mod gpu;

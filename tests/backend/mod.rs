mod cpu_gather;
mod doubled_faces;
mod gpu;
mod panes;

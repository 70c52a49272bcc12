mod measure;
mod path_tracer;

mod gathered;
mod image;

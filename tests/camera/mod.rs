mod gathered;
mod image;
mod second_pass;

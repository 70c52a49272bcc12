mod atlas;
mod files;
mod light;
mod shown_error;

mod atlas;
mod files;
mod light;

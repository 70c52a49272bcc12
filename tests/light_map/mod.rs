mod atlas;
mod light;

mod light;
mod places;

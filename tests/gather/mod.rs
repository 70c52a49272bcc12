mod point_irradiance;
mod shared;

mod point_irradiance;

mod point_irradiance;
mod shadow_edges;

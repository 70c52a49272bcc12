mod lamp_sides;
mod luminaires;
mod sides;
mod solar_irradiance;

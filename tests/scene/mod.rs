mod lamp_sides;
mod luminaires;
mod sides;

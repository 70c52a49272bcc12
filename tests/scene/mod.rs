mod luminaires;
mod sides;

mod sides;

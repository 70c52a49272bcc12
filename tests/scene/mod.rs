mod winding;

// Parameters of rows: put before the shaders that make them.

struct RowSettings {
    rays: u32,            // of a patch
    slots: u32,           // of a row
    unit: f32,
    entries: u32,         // capacity
}

@group(1) @binding(3) var<uniform> settings: RowSettings;

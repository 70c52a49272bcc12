// What rows are made with: put before the shaders that make them.

struct RowSettings {
    rays: u32,            // of a patch
    slots: u32,           // of a row
    unit: f32,
    entries: u32,         // that there is room for
}

@group(1) @binding(3) var<uniform> settings: RowSettings;

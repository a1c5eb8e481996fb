// Storage of the clip planes as each tile sees them: bounds below and above near, below and above
// far, in steps.
@group(0) @binding(7) var<storage, read> planes: array<vec4<f32>>;

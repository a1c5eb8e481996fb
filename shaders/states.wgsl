// Storage of what is known between passes.
@group(0) @binding(5) var<storage, read_write> states: array<State>;

//! What the ids of a picture are.

/// The id where no sphere is seen; `NONE` of `shaders/types.wgsl`.
pub const NONE: i32 = -1;
/// The id of a pixel that is still to be decided; `UNDECIDED` of `shaders/types.wgsl`. No finished
/// picture has it.
pub const UNDECIDED: i32 = -2;

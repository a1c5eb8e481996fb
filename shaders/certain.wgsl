// The filter is on: bounds as derived.
const U = 0x1p-23;
// Room for the rounding of the bounds themselves.
const SURE = 1.01;

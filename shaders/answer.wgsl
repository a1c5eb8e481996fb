// The answer of a pixel whose list was seen whole. Settled: in its own pass, and no other sphere's
// lower bound is within its upper bound.
fn answer(state: State) -> i32 {
    if state.low >= NEVER {
        return NONE;
    }
    return select(UNDECIDED, state.id, state.rest > state.high);
}

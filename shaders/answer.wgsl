// The answer of a pixel whose list was seen whole. Settled: no other sphere's lower bound is within the upper bound of the best.
fn answer(state: State) -> i32 {
    if state.low >= NEVER {
        return NONE;
    }
    return select(UNDECIDED, state.id, state.rest > state.high);
}

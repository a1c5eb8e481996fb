// The answer of a pixel with the filter off: the nearest, whatever the doubt.
fn answer(state: State) -> i32 {
    return state.id;
}

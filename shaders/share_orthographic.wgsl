// What of an orthographic item is passed from lane to lane.
fn share(item: Item, lane: u32) -> Item {
    return Item(
        subgroupShuffle(item.shape, lane),
        subgroupShuffle(item.bounds, lane),
        subgroupShuffle(item.safe, lane),
        subgroupShuffle(item.guard, lane),
        0.0,
        0.0,
    );
}

// Of the rays nothing is: they are the same in all tiles.
fn share_eye(eye: Eye, lane: u32) -> Eye {
    return eye;
}

// What of a perspective item is passed from lane to lane.
fn share(item: Item, lane: u32) -> Item {
    return Item(
        subgroupShuffle(item.even, lane),
        subgroupShuffle(item.odd, lane),
        subgroupShuffle(item.along, lane),
        subgroupShuffle(item.bounds, lane),
        subgroupShuffle(item.safe, lane),
        0.0,
        0.0,
    );
}

// What of a tile's rays is passed from lane to lane.
fn share_eye(eye: Eye, lane: u32) -> Eye {
    var there = eye;
    there.center = subgroupShuffle(eye.center, lane);
    there.apart = subgroupShuffle(eye.apart, lane);
    there.lift = subgroupShuffle(eye.lift, lane);
    return there;
}

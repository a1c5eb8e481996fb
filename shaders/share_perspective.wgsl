// What of a perspective item is passed from lane to lane.
fn share0(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 0u), subgroupBroadcast(item.reach, 0u), subgroupBroadcast(item.bounds, 0u), subgroupBroadcast(item.safe, 0u), 0.0, 0.0); }
fn share1(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 1u), subgroupBroadcast(item.reach, 1u), subgroupBroadcast(item.bounds, 1u), subgroupBroadcast(item.safe, 1u), 0.0, 0.0); }
fn share2(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 2u), subgroupBroadcast(item.reach, 2u), subgroupBroadcast(item.bounds, 2u), subgroupBroadcast(item.safe, 2u), 0.0, 0.0); }
fn share3(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 3u), subgroupBroadcast(item.reach, 3u), subgroupBroadcast(item.bounds, 3u), subgroupBroadcast(item.safe, 3u), 0.0, 0.0); }
fn share4(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 4u), subgroupBroadcast(item.reach, 4u), subgroupBroadcast(item.bounds, 4u), subgroupBroadcast(item.safe, 4u), 0.0, 0.0); }
fn share5(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 5u), subgroupBroadcast(item.reach, 5u), subgroupBroadcast(item.bounds, 5u), subgroupBroadcast(item.safe, 5u), 0.0, 0.0); }
fn share6(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 6u), subgroupBroadcast(item.reach, 6u), subgroupBroadcast(item.bounds, 6u), subgroupBroadcast(item.safe, 6u), 0.0, 0.0); }
fn share7(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 7u), subgroupBroadcast(item.reach, 7u), subgroupBroadcast(item.bounds, 7u), subgroupBroadcast(item.safe, 7u), 0.0, 0.0); }
// What of a tile's rays is passed from lane to lane.
fn eye_at(eye: Eye, center: vec2<f32>) -> Eye {
    var there = eye;
    there.center = center;
    return there;
}
fn eye0(eye: Eye) -> Eye { return eye_at(eye, subgroupBroadcast(eye.center, 0u)); }
fn eye2(eye: Eye) -> Eye { return eye_at(eye, subgroupBroadcast(eye.center, 2u)); }
fn eye4(eye: Eye) -> Eye { return eye_at(eye, subgroupBroadcast(eye.center, 4u)); }
fn eye6(eye: Eye) -> Eye { return eye_at(eye, subgroupBroadcast(eye.center, 6u)); }

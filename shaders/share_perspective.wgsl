// What of a perspective item is passed from lane to lane.
fn share0(item: Item) -> Item { return Item(subgroupBroadcast(item.even, 0u), subgroupBroadcast(item.odd, 0u), subgroupBroadcast(item.along, 0u), subgroupBroadcast(item.bounds, 0u), subgroupBroadcast(item.safe, 0u), 0.0, 0.0); }
fn share1(item: Item) -> Item { return Item(subgroupBroadcast(item.even, 1u), subgroupBroadcast(item.odd, 1u), subgroupBroadcast(item.along, 1u), subgroupBroadcast(item.bounds, 1u), subgroupBroadcast(item.safe, 1u), 0.0, 0.0); }
fn share2(item: Item) -> Item { return Item(subgroupBroadcast(item.even, 2u), subgroupBroadcast(item.odd, 2u), subgroupBroadcast(item.along, 2u), subgroupBroadcast(item.bounds, 2u), subgroupBroadcast(item.safe, 2u), 0.0, 0.0); }
fn share3(item: Item) -> Item { return Item(subgroupBroadcast(item.even, 3u), subgroupBroadcast(item.odd, 3u), subgroupBroadcast(item.along, 3u), subgroupBroadcast(item.bounds, 3u), subgroupBroadcast(item.safe, 3u), 0.0, 0.0); }
fn share4(item: Item) -> Item { return Item(subgroupBroadcast(item.even, 4u), subgroupBroadcast(item.odd, 4u), subgroupBroadcast(item.along, 4u), subgroupBroadcast(item.bounds, 4u), subgroupBroadcast(item.safe, 4u), 0.0, 0.0); }
fn share5(item: Item) -> Item { return Item(subgroupBroadcast(item.even, 5u), subgroupBroadcast(item.odd, 5u), subgroupBroadcast(item.along, 5u), subgroupBroadcast(item.bounds, 5u), subgroupBroadcast(item.safe, 5u), 0.0, 0.0); }
fn share6(item: Item) -> Item { return Item(subgroupBroadcast(item.even, 6u), subgroupBroadcast(item.odd, 6u), subgroupBroadcast(item.along, 6u), subgroupBroadcast(item.bounds, 6u), subgroupBroadcast(item.safe, 6u), 0.0, 0.0); }
fn share7(item: Item) -> Item { return Item(subgroupBroadcast(item.even, 7u), subgroupBroadcast(item.odd, 7u), subgroupBroadcast(item.along, 7u), subgroupBroadcast(item.bounds, 7u), subgroupBroadcast(item.safe, 7u), 0.0, 0.0); }
// What of a tile's rays is passed from lane to lane.
fn eye_at(eye: Eye, center: vec2<f32>, apart: f32, lift: f32) -> Eye {
    var there = eye;
    there.center = center;
    there.apart = apart;
    there.lift = lift;
    return there;
}
fn eye0(eye: Eye) -> Eye { return eye_at(eye, subgroupBroadcast(eye.center, 0u), subgroupBroadcast(eye.apart, 0u), subgroupBroadcast(eye.lift, 0u)); }
fn eye2(eye: Eye) -> Eye { return eye_at(eye, subgroupBroadcast(eye.center, 2u), subgroupBroadcast(eye.apart, 2u), subgroupBroadcast(eye.lift, 2u)); }
fn eye4(eye: Eye) -> Eye { return eye_at(eye, subgroupBroadcast(eye.center, 4u), subgroupBroadcast(eye.apart, 4u), subgroupBroadcast(eye.lift, 4u)); }
fn eye6(eye: Eye) -> Eye { return eye_at(eye, subgroupBroadcast(eye.center, 6u), subgroupBroadcast(eye.apart, 6u), subgroupBroadcast(eye.lift, 6u)); }

// What of an orthographic item is passed from lane to lane.
fn share0(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 0u), subgroupBroadcast(item.bounds, 0u), subgroupBroadcast(item.safe, 0u), subgroupBroadcast(item.guard, 0u), 0.0, 0.0); }
fn share1(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 1u), subgroupBroadcast(item.bounds, 1u), subgroupBroadcast(item.safe, 1u), subgroupBroadcast(item.guard, 1u), 0.0, 0.0); }
fn share2(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 2u), subgroupBroadcast(item.bounds, 2u), subgroupBroadcast(item.safe, 2u), subgroupBroadcast(item.guard, 2u), 0.0, 0.0); }
fn share3(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 3u), subgroupBroadcast(item.bounds, 3u), subgroupBroadcast(item.safe, 3u), subgroupBroadcast(item.guard, 3u), 0.0, 0.0); }
fn share4(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 4u), subgroupBroadcast(item.bounds, 4u), subgroupBroadcast(item.safe, 4u), subgroupBroadcast(item.guard, 4u), 0.0, 0.0); }
fn share5(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 5u), subgroupBroadcast(item.bounds, 5u), subgroupBroadcast(item.safe, 5u), subgroupBroadcast(item.guard, 5u), 0.0, 0.0); }
fn share6(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 6u), subgroupBroadcast(item.bounds, 6u), subgroupBroadcast(item.safe, 6u), subgroupBroadcast(item.guard, 6u), 0.0, 0.0); }
fn share7(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 7u), subgroupBroadcast(item.bounds, 7u), subgroupBroadcast(item.safe, 7u), subgroupBroadcast(item.guard, 7u), 0.0, 0.0); }
// Of the rays nothing is: they are the same in all tiles.
fn eye0(eye: Eye) -> Eye { return eye; }
fn eye2(eye: Eye) -> Eye { return eye; }
fn eye4(eye: Eye) -> Eye { return eye; }
fn eye6(eye: Eye) -> Eye { return eye; }

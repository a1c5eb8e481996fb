// What of a perspective item is passed from lane to lane.
fn share0(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 0u), subgroupBroadcast(item.size, 0u), subgroupBroadcast(item.bounds, 0u)); }
fn share1(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 1u), subgroupBroadcast(item.size, 1u), subgroupBroadcast(item.bounds, 1u)); }
fn share2(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 2u), subgroupBroadcast(item.size, 2u), subgroupBroadcast(item.bounds, 2u)); }
fn share3(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 3u), subgroupBroadcast(item.size, 3u), subgroupBroadcast(item.bounds, 3u)); }
fn share4(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 4u), subgroupBroadcast(item.size, 4u), subgroupBroadcast(item.bounds, 4u)); }
fn share5(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 5u), subgroupBroadcast(item.size, 5u), subgroupBroadcast(item.bounds, 5u)); }
fn share6(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 6u), subgroupBroadcast(item.size, 6u), subgroupBroadcast(item.bounds, 6u)); }
fn share7(item: Item) -> Item { return Item(subgroupBroadcast(item.shape, 7u), subgroupBroadcast(item.size, 7u), subgroupBroadcast(item.bounds, 7u)); }

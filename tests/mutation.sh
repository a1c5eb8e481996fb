#!/usr/bin/env bash
# The proof that the tests prove something: each of a list of small faults is put into a copy of the sources, and a test that is
# named with it must fail. Bounds are divided by eight, terms of bounds dropped, tie rules and comparisons turned round, short cuts
# taken too early. A fault that no test finds fails this script.
#
#   tests/mutation.sh            all faults: half an hour and more on two cores, so it is not part of tests/run.sh
#   tests/mutation.sh --few      one fault of each kind: five minutes or so after the first build
#   tests/mutation.sh WORD...    faults whose names contain a word
#   tests/mutation.sh --check    none, but looks whether each is still there to be put in: part of .ci/run
#
# The copy lies in target/mutation/tree and has a target folder of its own, so that a fault costs the build of this crate alone.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
tree=$root/target/mutation/tree
log=$root/target/mutation/log
words=("$@")
few=no
check=no
case "${1:-}" in
    --few) few=yes words=() ;;
    --check) check=yes words=() ;;
esac

if [[ $check == no ]]; then
    # The sources as they are here, changes included; files that did not change keep their age, for cargo's sake.
    mkdir -p "$tree"
    rsync_list=$(git ls-files --cached --others --exclude-standard)
    while IFS= read -r file; do
        if [[ -f "$file" ]] && ! cmp -s "$file" "$tree/$file"; then
            mkdir -p "$tree/$(dirname "$file")"
            cp "$file" "$tree/$file"
        fi
    done <<<"$rsync_list"
    export CARGO_TARGET_DIR=$root/target/mutation/build
    export CARGO_INCREMENTAL=1 CARGO_PROFILE_RELEASE_DEBUG=false
    cd "$tree"
    printf '%-58s %-34s %s\n' fault 'found by' result
fi

found=0
there=0
survivors=()
faulty=()

# fault NAME FILE OLD NEW CASE TEST...: OLD, which must be in the file once, becomes NEW; then the tests must fail.
# CASE restricts the corpus to scenes with that word.
fault() {
    local name=$1 file=$2 old=$3 new=$4 case=$5
    shift 5
    if ((${#words[@]} > 0)); then
        local word wanted=no
        for word in "${words[@]}"; do
            [[ "$name" == *"$word"* ]] && wanted=yes
        done
        [[ $wanted == yes ]] || return 0
    fi
    local count
    count=$(OLD=$old perl -0777 -ne 'my $n = () = /\Q$ENV{OLD}\E/g; print $n' "$file")
    if [[ "$count" != 1 ]]; then
        printf '%-58s %-34s %s\n' "$name" "$*" "NOT THERE: $count times in $file"
        faulty+=("$name")
        return 0
    fi
    if [[ $check == yes ]]; then
        there=$((there + 1))
        return 0
    fi
    cp "$file" "$log.original"
    OLD=$old NEW=$new perl -0777 -pi -e 's/\Q$ENV{OLD}\E/$ENV{NEW}/' "$file"
    local result
    if PLANISPHERE_CASE=$case timeout 900 cargo test --release --locked --all-features "$@" >"$log" 2>&1; then
        result=SURVIVED
        survivors+=("$name")
    elif grep -q '^test result: FAILED' "$log"; then
        result="found: $(grep -m1 -oP '^test \K\S+(?= \.\.\. FAILED)|^    \K[\w:]+$' "$log" || true)"
        found=$((found + 1))
    else
        result="NO ANSWER: $(grep -m1 -E '^error|signal|panicked' "$log" || true)"
        faulty+=("$name")
    fi
    cp "$log.original" "$file"
    printf '%-58s %-34s %s\n' "$name" "${*#--}" "$result"
}

# Faults that --few leaves out.
more() {
    [[ $few == yes ]] || fault "$@"
}

f=src/filter.rs
fault 'E / 8' $f 'const DOUBT: f64 = 2.9;' 'const DOUBT: f64 = 2.9 / 8.0;' '' --test bounds doubt
more 'never vague' $f 'const VAGUE: f64 = 1024.0;' 'const VAGUE: f64 = 0.0;' '' --test bounds doubt
more 'T = E / 10' $f 'const SOLID: f64 = 4.0;' 'const SOLID: f64 = 0.1;' '' --test bounds width
more 'W / 8, parallel' $f 'const WIDTH_PARALLEL: f64 = 0.58;' 'const WIDTH_PARALLEL: f64 = 0.58 / 8.0;' '' --test bounds width
more 'W / 8, perspective' $f 'const WIDTH_PERSPECTIVE: f64 = 0.62;' 'const WIDTH_PERSPECTIVE: f64 = 0.62 / 8.0;' '' --test bounds width
more 'rim / 8' $f 'const RIM: f64 = 1.14;' 'const RIM: f64 = 1.14 / 8.0;' '' --test bounds rim
more 'rim of vague spheres without the place' $f 'const MIDDLE: f64 = 2.2;' 'const MIDDLE: f64 = 0.0;' '' --test bounds rim
more 'rim of vague spheres / 8' $f 'let rim = spread.sqrt() * s.r + MIDDLE' 'let rim = spread.sqrt() * s.r / 8.0 + MIDDLE' '' --test bounds rim
more 'bound of a plane / 8' $f 'pub const PLANE: f64 = 10.0 * U;' 'pub const PLANE: f64 = 10.0 / 8.0 * U;' '' --test bounds depths_of_the_screen
more 'bound of y / a, over 8' $f 'pub const BACK: f64 = 10.0 * U;' 'pub const BACK: f64 = 10.0 / 8.0 * U;' '' --test bounds depths_of_the_screen
more 'E without underflow' $f 'spread * (DOUBT * s.r * delta + FLOOR)' 'spread * (DOUBT * s.r * delta)' '' --test bounds underflow
more 'gone with the near root' $f '|| (outside(first) && outside(second))' '|| outside(first)' 'inside' --test exactness cpu::every_pixel
more 'near root for far' $f '            second
        } else {' '            first
        } else {' 'inside' --test exactness cpu::every_pixel

f=src/project.rs
more 'P / 8' $f 'const POSITION: f64 = 8.0 * U;' 'const POSITION: f64 = U;' '' --test bounds position
more 'nearest point without P' $f 'self.z - self.r - self.bound()' 'self.z - self.r' '' --test bounds nearest
more 'farthest point without P' $f 'self.z + self.r + self.bound()' 'self.z + self.r' '' --test bounds farthest
more 'footprint, widening / 8' $f 'pub const REACH: f64 = 1.5;' 'pub const REACH: f64 = 1.5 / 8.0;' '' --test bounds footprints
more 'footprint, margin / 8' $f 'pub const MARGIN: f64 = f64::from_bits((1023 - 38) << 52);' 'pub const MARGIN: f64 = f64::from_bits((1023 - 41) << 52);' '' --test bounds footprints
fault 'slopes of tangents, bound / 8' $f 'pub const SLOPE: f64 = 12.0 * U;' 'pub const SLOPE: f64 = 1.5 * U;' '' --test bounds tangents
more 'planes cut nothing' $f '!((s.z - s.r - bound > self.near) & (s.z + s.r + bound < self.far))' '(s.z - s.r - bound > self.far)' 'near ' --test exactness cpu::every_pixel

f=src/pair.rs
fault 'order of a pair, bound / 8' $f 'Apart { difference, bound: self.bound, solid }' 'Apart { difference, bound: self.bound / 8.0, solid }' '' --test bounds pairs
more 'far walls ordered as near ones' $f 'Root::Far => along.add(squares),' 'Root::Far => along.sub(squares),' 'heap of 120' --test exactness cpu::every_pixel
more 'pairs are cut by no plane' $f 'if !self.cut {' 'if self.cut || !self.cut {' 'heap of 120' --test exactness cpu::every_pixel
more 'all lie in one another' $f 'rho > 0.0 && (delta' 'rho > 0.0 || (delta' 'in one another' --test exactness skipping::every_pixel

f=src/bins.rs
more 'edge of a slab, bound / 8' $f 'pub const EDGE: f64 = 4.0 * U;' 'pub const EDGE: f64 = 0.5 * U;' '' --test bounds slabs
more 'tiles that miss a disc, bound / 8' $f 'pub const APART: f64 = 1.5;' 'pub const APART: f64 = 1.5 / 8.0;' '' --test bounds misses

more 'lists by what they touch: a tile in 64 left out' $f 'touched[tile / 64] |= 1 << (tile % 64);' 'touched[tile / 64] |= u64::from(tile % 64 > 0) << (tile % 64);' '' --test gpu few_spheres
more 'lists: counts of the picture before' $f '                self.counts[key] = 0;' '                self.counts[key] += 0;' '' --test gpu few_spheres
more 'groups hidden that begin anywhere in front' $f 'columns.all(|column| nearest' 'columns.any(|column| nearest' '' --test gpu large

f=src/exact/dd.rs
fault 'sum of pairs, bound / 8' $f 'const SUM: f64 = 3.0 * U * U;' 'const SUM: f64 = 3.0 / 8.0 * U * U;' '' --lib exact::dd
more 'product of pairs, bound / 8' $f 'const PRODUCT: f64 = 5.0 * U * U;' 'const PRODUCT: f64 = 5.0 / 8.0 * U * U;' '' --lib exact::dd
more 'no bound for underflow' $f 'const ABSOLUTE: f64 = f64::from_bits((1023 - 960) << 52);' 'const ABSOLUTE: f64 = 0.0;' '' --lib exact::dd
more 'ends of a pair, bound / 8' $f 'let off = (self.error + self.high.abs() * f64::EPSILON) * UP;' 'let off = (self.error + self.high.abs() * (f64::EPSILON / 8.0)) * UP;' '' --lib exact::dd
more 'components of axes, bound / 8' src/exact/axes.rs 'pub const ERROR: f64 = f64::from_bits((1023 - 107) << 52);' 'pub const ERROR: f64 = f64::from_bits((1023 - 110) << 52);' '' --lib exact::axes

f=src/exact/decide.rs
fault 'tangents miss' $f 'if sign_q < 0 {' 'if sign_q <= 0 {' '' --test exactness cpu::every_pixel

more 'near plane left out' $f 'let root = if self.side(&numbers, Root::Near, Plane::Near, tally) >= 0 {' 'let root = if self.side(&numbers, Root::Near, Plane::Near, tally) > 0 {' 'near' --test exactness cpu::every_pixel
more 'near plane left out for inner walls' $f '} else if self.side(&numbers, Root::Far, Plane::Near, tally) >= 0 {' '} else if self.side(&numbers, Root::Far, Plane::Near, tally) > 0 {' 'near' --test exactness cpu::every_pixel
more 'far plane left out' $f 'root, Plane::Far, tally) <= 0)' 'root, Plane::Far, tally) < 0)' 'far' --test exactness cpu::every_pixel
more 'inner walls at once' $f 'Self::Near => -1,' 'Self::Near => 1,' '' --test exactness cpu::every_pixel
more 'depths of 100 bits whatever cancels' $f 'if y.is_within(0.25 * DISTANCE_ERROR) {' 'if y.is_within(1e300) || true {' 'camera' --test exactness depths_are
more 'order of lattices: the radius does not drop out' src/exact/small.rs 'if same_radius && s == t' 'if s == t' '' --test exactness cpu::every_pixel

f=src/exact/distance.rs
fault 'bounds of distances, E / 8' $f 'let low = value.min(f64::MAX) * (1.0 - 2.0 * DISTANCE_ERROR) - 2.0 * LEAST;' 'let low = value.min(f64::MAX) * (1.0 - 0.25 * DISTANCE_ERROR) - 2.0 * LEAST;' '' --lib exact::distance
more 'upper bounds of distances, E / 8' $f 'value * (1.0 + 2.0 * DISTANCE_ERROR) + 2.0 * LEAST]' 'value * (1.0 + 0.25 * DISTANCE_ERROR) + 2.0 * LEAST]' '' --lib exact::distance
more 'bounds of subnormal distances without roundings' $f '(1.0 - 2.0 * DISTANCE_ERROR) - 2.0 * LEAST;' '(1.0 - 2.0 * DISTANCE_ERROR);' '' --lib exact::distance
more 'upper bounds of subnormal distances without roundings' $f '(1.0 + 2.0 * DISTANCE_ERROR) + 2.0 * LEAST]' '(1.0 + 2.0 * DISTANCE_ERROR)]' '' --lib exact::distance
more 'distances beyond f64: infinite bounds' $f 'let low = value.min(f64::MAX)' 'let low = value' '' --test merge extreme
more 'long integers without what is cut off' $f 'leading).times_two_to(drop as i64)' 'leading).times_two_to(drop.min(2000) as i64)' '' --lib exact::distance

f=src/exact/decide.rs
fault 'distances in view lengths' $f 'return y.over(a).times_two_to(-self.truth.scale_exponent());' 'return y.over(a);' 'cloud times' --test exactness depths_are
more 'distances by integers to 12 bits' $f '<= (&low >> 48)' '<= (&low >> 12)' '' --test merge extreme
more 'distances by products: the unit once' $f '2 * i64::from(exponent) + truth.scale_exponent()' 'i64::from(exponent) + truth.scale_exponent()' 'camera' --test exactness depths_are
more 'rough bounds: the far end twice' $f '[end(low, most)[0], end(high, least)[1]]' '[end(high, least)[0], end(high, least)[1]]' '' --test merge extreme

f=src/frame/depth.rs
fault 'depths beyond f32 are the background' $f '(distance as f32).min(f32::MAX)' '(distance as f32)' 'cloud times' --test exactness depths_are
more 'bounds of the filter however wide' $f 'Some([low, high]) if high - low <= BOUNDS_RATIO * high => bounds,' 'Some(_) => bounds,' '' --test merge extreme

f=src/part/merge.rs
fault 'parts: boxes without depth' $f '[sphere.nearest(), sphere.farthest()]' '[sphere.z, sphere.z]' '' --test merge pictures_in_parts
more 'parts: distances are believed' $f 'if !(sound & (low <= slot.reach[1]) & (slot.reach[0] <= high)) {' 'if !sound {' '' --test merge lie
more 'parts: unsound bounds are believed' $f 'if !(sound & (low <= slot.reach[1])' 'if !((low <= slot.reach[1])' '' --test merge lie
more 'parts: distances are believed where parts compete' $f 'if !(said[0] <= found[1] && found[0] <= said[1]) {' 'if said[0] > said[1] {' '' --test merge lie
more 'parts: places are believed' $f 'if !((first_column..=last_column).contains(&column) && (first_row..=last_row).contains(&row)) {' 'if column < first_column && row > last_row {' '' --test merge lie
more 'parts: distances of none are believed' $f 'if bounds != [f64::INFINITY; 2] {' 'if bounds[0] < 0.0 {' '' --test merge lie
more 'parts: boxes are all that is compared' $f 'let held = desk.reach[at];' 'let held = [found[1].next_up(); 2];' '' --test merge pictures_in_parts
more 'parts: ties to the later' $f 'then(one.cmp(&other)) == Ordering::Less' 'then(other.cmp(&one)) == Ordering::Less' '' --test merge pictures_in_parts
more 'parts: the loser keeps its bounds' $f '        if first {
            desk.reach[at] = found;
        }' '' '' --test merge pictures_in_parts
more 'parts: extents are believed' src/load/part.rs '(inside && own.min_radius >= all.min_radius && own.max_radius <= all.max_radius)' '(inside && own.max_radius <= all.max_radius)' '' --test merge lie

f=src/tile.rs
fault 'ties to the higher index' $f 'order.then(index.cmp(&holder)).is_gt()' 'order.then(holder.cmp(&index)).is_gt()' '' --test exactness cpu::every_pixel
more 'duplicates: the higher index' $f 'self.id[row][column] = holder.min(index);' 'self.id[row][column] = holder.max(index);' 'twice' --test exactness cpu::every_pixel
more 'duplicates at a glance: the higher index' $f 'index.min(*holder)' 'index.max(*holder)' 'twice' --test exactness cpu::every_pixel
more 'lower bounds of holders as the upper' $f 'let slack = 1.05 * width;' 'let slack = 0.0 * width;' '' --test exactness cpu::every_pixel
more 'of the rows to decide in the last alone' $f 'self.open |= 1 << row;' 'self.open = 1 << row;' '' --test exactness cpu::every_pixel
more 'blocks as far as their last row' $f '(place, sx, row, high).max(farthest);' '(place, sx, row, high);' '' --test exactness cpu::every_pixel
f=src/cpu/paint.rs
more 'hidden by the nearest block' $f 'farthest = if block > farthest { block } else { farthest };' 'farthest = if farthest > f64::NEG_INFINITY { farthest } else { block };' '' --test exactness cpu::every_pixel
more 'hidden by nothing' $f '    nearest > farthest
}' '    nearest > farthest - 1.0
}' '' --test exactness cpu::every_pixel
more 'early stop a slab too soon' $f 'if self.depths.farthest < grid.slab_start(slab) {
                break;
            }
            for some in [self' 'if self.depths.farthest < grid.slab_start(slab + 1) {
                break;
            }
            for some in [self' '' --test exactness cpu::deep_tiles
more 'early stop a slab of groups too soon' $f 'if self.depths.farthest < grid.slab_start(slab) {
                break;
            }
            groups.clear' 'if self.depths.farthest < grid.slab_start(slab + 1) {
                break;
            }
            groups.clear' '' --test exactness skipping::deep_tiles
more 'backgrounds before other spheres' $f 'sphere_or_group().farthest() < sphere.nearest()' 'sphere_or_group().nearest() < sphere.nearest()' '' --test exactness cpu::every_pixel
more 'groups hidden by their middle' $f 'Self { index, nearest: towards_eye(nearest), window }' 'Self { index, nearest: towards_eye(nearest + 1.0), window }' '' --test exactness skipping::every_pixel

f=src/order.rs
fault 'groups that do not hold their spheres' $f 'block.center(sphere).distance(middle) + block.radius(sphere)' 'block.center(sphere).distance(middle)' '' --test exactness skipping::every_pixel
more 'of many that are the same the last is kept' $f 'hashes.par_sort_unstable();' 'hashes.par_sort_unstable_by_key(|h| (h.0, u32::MAX - h.1));' 'twice' --test exactness skipping::every_pixel
f=src/cover.rs
fault 'covers: the nearest corner' $f 'greatest = greatest.max(depth + depth.abs() * BACK);' 'greatest = if greatest > f64::NEG_INFINITY { greatest.min(depth) } else { depth };' '' --test gpu large
more 'covers: one corner is enough' $f 'let Look::Seen([_, high]) = look else { return None };' 'let Look::Seen([_, high]) = look else { continue };' '' --test gpu large
more 'covers: left out where more is seen' src/bins.rs 'found.mixed[tile] |= !(sphere.farthest() < begins);' 'found.mixed[tile] |= sphere.nearest() > begins;' '' --test gpu behind
more 'covers: left out of several waves' src/bins.rs '&& (!whole || found.iter()' '&& (found.iter()' '' --test gpu large
more 'covers: not seen where the host decides' src/gpu/decide.rs 'if id == NONE { background } else { id }' 'id' '' --test gpu behind
f=src/gpu/decide.rs
more 'GPU, decisions: a duplicate by its depth alone' $f 'again |= indices[earlier] < index && balls[earlier] == ball;' 'again |= indices[earlier] < index;' '' --test exactness gpu::every_pixel
more 'GPU, decisions: early stop at the first behind' $f 'L::load(&batch.begin).sub(L::splat(disorder))' 'L::load(&batch.nearest)' '' --test exactness gpu::every_pixel
more 'GPU, decisions: rows of tiles counted from the first' $f 'self.left_over.rows(tiles, first_row, ids)' 'self.left_over.rows(tiles, 0, ids)' '' --test exactness gpu::every_pixel
more 'GPU, decisions: many tiles are not shared out' $f '            return false;' '            return true;' '' --test exactness gpu::every_pixel
f=src/tile.rs
more 'GPU, decisions: fronts without W' $f 'root.add(L::splat(width))' 'root' '' --test bounds fronts
more 'GPU, decisions: fronts without the rim' $f 'r.mul(L::splat(rim)).max(' 'r.mul(L::splat(0.0)).max(' '' --test bounds fronts
more 'GPU, decisions: fronts missed without E' $f 'q.less(r.mul(L::splat(-doubt)))' 'q.less(r.mul(L::splat(0.0)))' '' --test bounds fronts

f=src/exact/small.rs
more 'symmetry: rational roots taken for independent' $f '[_, None, Some(root_ab)] => y * root_ab == p && x == 0,' '[_, None, Some(root_ab)] => x * root_ab == p && y == 0,' '' --lib exact::decide
more 'symmetry: depths left out' $f 'if dot(f, self.d) != dot(h, self.d) {' 'if dot(f, self.d) != dot(f, self.d) {' '' --lib exact::decide

f=src/plan.rs
more 'rotated centres, bound / 8' $f 'const ROTATION_ERROR: f64 = 3.125;' 'const ROTATION_ERROR: f64 = 3.125 / 8.0;' '' --test adversary places
more 'longest axes, twice as long' $f 'const LONGEST: f64 = 1.5;' 'const LONGEST: f64 = 3.0;' '' --lib plan
more 'f64 of the host, bound / 8' $f 'let error = power(-53) * ulps' 'let error = power(-56) * ulps' '' --lib plan

more 'perspective tiles that begin too far before the data' $f '|| z <= OFFSET_LIMIT;' '|| z < f64::INFINITY;' '' --test gpu planets
more 'perspective keys, no margin' $f '1.07 * spread * (1024.0' '0.0 * spread * (1024.0' '' --test adversary depths

f=shaders/orthographic.wgsl
more 'GPU, orthographic: E / 8' $f 'let error = eye.error.x + ' 'let error = 0.125 * eye.error.x + 0.125 * ' '' --test adversary squares
more 'GPU, orthographic: slack / 8' $f 'let slack = 0.5 * eye.doubt + SURE * U *' 'let slack = 0.0625 * eye.doubt + 0.125 * SURE * U *' '' --test adversary depths
more 'GPU, orthographic: spheres begin at the middle' $f '        z - radius,' '        z,' '' --test adversary depths
fault 'GPU, orthographic: E without the place' $f '2.9 * frame.delta, 20.0 * U' '0.0 * frame.delta, 20.0 * U' '' --test adversary squares
more 'GPU, orthographic: E without roundings' $f '2.9 * frame.delta, 20.0 * U' '2.9 * frame.delta, 0.0 * U' '' --test adversary squares
more 'GPU, orthographic: E without the place squared' $f '2.2 * frame.delta * frame.delta' '0.0 * frame.delta' '' --test adversary squares
more 'GPU, orthographic: doubt / 8' $f 'let doubt = eye.doubt + (SURE' 'let doubt = 0.125 * eye.doubt + 0.125 * (SURE' '' --test adversary depths
more 'GPU, orthographic: doubt without what hits are late' $f 'SURE * 0.61 * root' 'SURE * 0.0 * root' '' --test adversary depths
more 'GPU, orthographic: a guard at the centre' $f 'greater(z - (1.45 * root + doubt), 0.0)' 'greater(z, 0.0)' '' --test adversary settled
f=shaders/perspective.wgsl
more 'GPU, perspective: E / 8' $f 'let early = eye.spread' 'let early = 0.125 * eye.spread' '' --test adversary squares
more 'GPU, perspective: E without the place' $f '2.9 * frame.delta, U' '0.0 * frame.delta, U' '' --test adversary squares
more 'GPU, perspective: E without roundings of radii' $f 'bounds.error.z + bounds.error.w * g' '0.0' '' --test adversary squares
more 'GPU, perspective: E without roundings of places' $f 'bounds.weight * g' '0.0 * bounds.weight' '' --test adversary squares
more 'GPU, perspective: E without the place squared' $f '2.2 * frame.delta * frame.delta' '0.0 * frame.delta' '' --test adversary squares
more 'GPU, perspective: E is not in the square' $f '(square * eye.a + early) - (away - late)' 'square * eye.a - away' '' --test adversary squares
more 'GPU, perspective: slack / 8' $f 'let slack = 0.5 * (eye.doubt' 'let slack = 0.0625 * (eye.doubt' '' --test adversary depths
more 'GPU, perspective: spheres begin at the middle' $f 'select(z - radius, -1e30, huge)' 'select(z, -1e30, huge)' '' --test adversary depths
more 'GPU, perspective: doubt / 8' $f 'eye.doubt + (SURE' '0.125 * eye.doubt + 0.125 * (SURE' '' --test adversary depths
more 'GPU, perspective: doubt without what hits are late' $f 'SURE * 0.62 * root' 'SURE * 0.0 * root' '' --test adversary depths
more 'GPU, perspective: keys without the lift' $f 'vec3<f32>(eye.lift + (z * eye.a' 'vec3<f32>((z * eye.a' '' --test adversary depths
more 'GPU, perspective: depths of keys of the middle' $f '(found - rays.shift) * rays.inverse' 'found - vec4<f32>(rays.lift)' '' --test adversary depths
more 'GPU, perspective: error of planes / 8' $f 'SURE * U * (16.0 * abs(depth) * rays.a + vec4<f32>(14.0 * rays.lift))' 'SURE * U * (2.0 * abs(depth) * rays.a + vec4<f32>(1.75 * rays.lift))' '' --test adversary planes
more 'GPU, perspective: planes of the middle' $f 'return rays.shift + depth * rays.a;' 'return vec4<f32>(rays.lift + depth);' '' --test adversary settled
more 'GPU, perspective: lower rows like upper ones' $f 'chord(even - odd, middle - tilt)' 'chord(even + odd, middle - tilt)' '' --test adversary settled
more 'GPU: roots by half of their bits, one too few' shaders/types.wgsl '0x1fc00001u' '0x1fc00000u' '' --test adversary roots
more 'GPU, short lists: the first entry alone' shaders/tiles_few_subgroup8.wgsl 'if lane % 2u >= tile.count {' 'if lane % 2u >= 1u {' '' --test exactness gpu_skipping::every_pixel
more 'GPU, short lists: lists of three' src/plan.rs 'count <= limits.few' 'count <= limits.few + u32::from(limits.few > 0)' '' --test exactness gpu_skipping::every_pixel
more 'GPU, doubt of tiles: the last item alone' shaders/tiles_portable.wgsl 'doubt = doubtful(doubt, item);' 'doubt = item.doubt * 0.001;' '' --test adversary settled
more 'GPU: the best is always right' shaders/certain.wgsl 'found.rest > high' 'found.rest > vec4<u32>(0u)' '' --test adversary settled
more 'GPU: what was undecided is forgotten' shaders/certain.wgsl 'select(undecided, found.entry, found.rest > high)' 'found.entry' '' --test adversary settled
more 'GPU: unsafe bests are kept' shaders/safe.wgsl 'low > select(vec4<u32>(range.zero), best, safe(range, item, c))' 'low > best' '' --test adversary settled
more 'GPU: unsafe bests are kept where planes cut' shaders/safe_clipped.wgsl '!safe(range, item, c) | (low > best)' 'low > best' '' --test adversary settled
more 'GPU: bests behind the guard are kept' shaders/guard.wgsl 'low > min(best, vec4<u32>(bitcast<u32>(item.guard)))' 'low > best' '' --test adversary settled
more 'GPU: what lost is not among the others' shaders/certain.wgsl 'select(old.low, min(old.rest, low), lost)' 'select(old.low, old.rest, lost)' '' --test adversary settled
more 'GPU: the best before is not among the others' shaders/certain.wgsl 'select(old.low, min(old.rest, low), lost)' 'min(old.rest, select(vec4<u32>(~0u), low, lost))' '' --test adversary settled
more 'GPU: keys of unsafe hits are not kept' shaders/nearest.wgsl 'min(old.low, low),' 'select(low, old.low, lost),' '' --test adversary settled
more 'GPU: the best of several passes is always right' shaders/answer.wgsl 'state.rest > state.high' 'state.rest >= 0.0' '' --test adversary settled
more 'GPU: the best of two passes is the farther' shaders/finish_merge.wgsl 'found.high < old.high ||' 'found.high > old.high ||' '' --test adversary settled
more 'GPU: the rest of earlier passes is forgotten' shaders/finish_merge.wgsl 'min(old.rest, select(found.low, old.low, better))' 'select(min(old.rest, found.low), old.low, better)' '' --test adversary merged
more 'GPU: the other of two passes is forgotten' shaders/finish_merge.wgsl 'min(old.rest, select(found.low, old.low, better))' 'old.rest' '' --test adversary settled

if [[ $check == yes ]]; then
    echo "$there faults can be put in"
else
    echo
    echo "$found faults found"
fi
if ((${#survivors[@]} > 0)); then
    printf 'SURVIVED: %s\n' "${survivors[@]}"
fi
if ((${#faulty[@]} > 0)); then
    printf 'no answer: %s\n' "${faulty[@]}"
fi
((${#survivors[@]} + ${#faulty[@]} == 0))

// Draws the ids of spheres with Embree 3, for benches/peers.sh: the same arrays, the same parallel
// rays, the same output as `planisphere render --ids`.
//
//   embree CENTERS.npy RADIUS OX OY OZ VX VY VZ UX UY UZ WIDTH PIXELS points|spheres|groups
//   low|medium|high IDS.npy FRAMES
//       [EXACT.npy]
//
// CENTERS is float32 (N, 3), little-endian; all spheres have one RADIUS. The camera is orthographic
// at O, looks along V with U up, and sees WIDTH world units across a square picture of PIXELS. What
// Embree is given: points   its own sphere points: the usual way, and the slowest spheres  one user
// geometry with a primitive for each sphere; the callback tests a whole packet at once groups   one
// user geometry with a primitive for each 8 neighbours along a Morton curve; the same callback The
// build quality is Embree's. Rays go in packets of 16 or 8, whichever this processor has natively,
// in blocks of neighbouring pixels, marked as coherent, on all cores by TBB: what Embree's own
// documentation advises. With FRAMES > 0 so many more pictures are drawn with everything built, the
// camera 1.37 pixels aside each time, and the median milliseconds are printed, of wall time and of
// processor time. With EXACT the pixels that differ are counted.

#include <embree3/rtcore.h>

#include <fcntl.h>
#include <immintrin.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace {

[[noreturn]] void stop(const std::string &why) {
    std::fprintf(stderr, "embree: %s\n", why.c_str());
    std::exit(2);
}

// A mapped .npy file: where its numbers begin, and how many 4-byte numbers there are.
struct Array {
    const char *numbers;
    size_t count;
};

Array map_npy(const char *path) {
    const int file = open(path, O_RDONLY);
    struct stat data {};
    if (file < 0 || fstat(file, &data) != 0)
        stop(std::string("cannot read ") + path);
    const size_t size = static_cast<size_t>(data.st_size);
    if (size < 10)
        stop(std::string("not an array: ") + path);
    void *bytes = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
    if (bytes == MAP_FAILED)
        stop(std::string("cannot map ") + path);
    const char *start = static_cast<const char *>(bytes);
    uint16_t header = 0;
    std::memcpy(&header, start + 8, 2);
    if (std::memcmp(start, "\x93NUMPY\x01", 7) != 0 || 10u + header > size)
        stop(std::string("not an array: ") + path);
    return {start + 10 + header, (size - 10 - header) / 4};
}

void write_ids(const char *path, const std::vector<int32_t> &ids, unsigned pixels) {
    const std::string side = std::to_string(pixels);
    std::string dict =
        "{'descr': '<i4', 'fortran_order': False, 'shape': (" + side + ", " + side + "), }";
    dict.append(63 - (10 + dict.size()) % 64, ' ');
    dict.push_back('\n');
    const uint16_t length = static_cast<uint16_t>(dict.size());
    FILE *file = std::fopen(path, "wb");
    if (!file)
        stop(std::string("cannot write ") + path);
    bool fine = std::fwrite("\x93NUMPY\x01\x00", 1, 8, file) == 8;
    fine = fine && std::fwrite(&length, 2, 1, file) == 1 &&
           std::fwrite(dict.data(), 1, dict.size(), file) == dict.size();
    fine = fine && std::fwrite(ids.data(), 4, ids.size(), file) == ids.size();
    if (std::fclose(file) != 0 || !fine)
        stop(std::string("cannot write ") + path);
}

// Milliseconds of processor time of all threads so far.
double cpu_time() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto milliseconds = [](const timeval &time) {
        return 1e3 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_usec);
    };
    return milliseconds(usage.ru_utime) + milliseconds(usage.ru_stime);
}

double median(std::vector<double> &values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

struct Vec {
    double x, y, z;
};

Vec operator*(double s, Vec v) { return {s * v.x, s * v.y, s * v.z}; }
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec cross(Vec a, Vec b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Vec unit(Vec v) { return 1 / std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z) * v; }

struct View {
    Vec origin, right, up, forward;
    double pitch;
    unsigned pixels;
};

// A packet's numbers in one register. A processor with packets of 16 has AVX-512, one with packets
// of 8 has AVX2; the compiler is told to build for the processor that it runs on.
#ifdef __AVX512F__
struct Lanes {
    static constexpr unsigned count = 16;
    using Packet = RTCRayHit16;
    using Floats = __m512;
    using Mask = __mmask16;
    static Floats load(const float *from) { return _mm512_load_ps(from); }
    static Floats all(float value) { return _mm512_set1_ps(value); }
    static Floats sub(Floats a, Floats b) { return _mm512_sub_ps(a, b); }
    static Floats mul(Floats a, Floats b) { return _mm512_mul_ps(a, b); }
    static Floats fma(Floats a, Floats b, Floats c) { return _mm512_fmadd_ps(a, b, c); }
    static Floats root(Floats a) { return _mm512_maskz_sqrt_ps(0xffff, a); }
    static Mask valid(const int *valid) {
        const __m512i lanes = _mm512_loadu_si512(valid);
        return _mm512_test_epi32_mask(lanes, lanes);
    }
    // Where a is at least, or less than, b; lanes outside of a mask are not.
    static Mask least(Mask mask, Floats a, Floats b) {
        return _mm512_mask_cmp_ps_mask(mask, a, b, _CMP_GE_OQ);
    }
    static Mask less(Mask mask, Floats a, Floats b) {
        return _mm512_mask_cmp_ps_mask(mask, a, b, _CMP_LT_OQ);
    }
    static bool none(Mask mask) { return mask == 0; }
    static Floats choose(Mask mask, Floats yes, Floats no) {
        return _mm512_mask_blend_ps(mask, no, yes);
    }
    static void store(float *to, Mask mask, Floats values) {
        _mm512_mask_store_ps(to, mask, values);
    }
    static void store(unsigned *to, Mask mask, unsigned value) {
        _mm512_mask_store_epi32(to, mask, _mm512_set1_epi32(static_cast<int>(value)));
    }
};
#elif defined(__AVX2__) && defined(__FMA__)
struct Lanes {
    static constexpr unsigned count = 8;
    using Packet = RTCRayHit8;
    using Floats = __m256;
    using Mask = __m256;
    static Floats load(const float *from) { return _mm256_load_ps(from); }
    static Floats all(float value) { return _mm256_set1_ps(value); }
    static Floats sub(Floats a, Floats b) { return _mm256_sub_ps(a, b); }
    static Floats mul(Floats a, Floats b) { return _mm256_mul_ps(a, b); }
    static Floats fma(Floats a, Floats b, Floats c) { return _mm256_fmadd_ps(a, b, c); }
    static Floats root(Floats a) { return _mm256_sqrt_ps(a); }
    static Mask valid(const int *valid) {
        return _mm256_loadu_ps(reinterpret_cast<const float *>(valid));
    }
    static Mask least(Mask mask, Floats a, Floats b) {
        return _mm256_and_ps(mask, _mm256_cmp_ps(a, b, _CMP_GE_OQ));
    }
    static Mask less(Mask mask, Floats a, Floats b) {
        return _mm256_and_ps(mask, _mm256_cmp_ps(a, b, _CMP_LT_OQ));
    }
    static bool none(Mask mask) { return _mm256_movemask_ps(mask) == 0; }
    static Floats choose(Mask mask, Floats yes, Floats no) {
        return _mm256_blendv_ps(no, yes, mask);
    }
    static void store(float *to, Mask mask, Floats values) {
        _mm256_maskstore_ps(to, _mm256_castps_si256(mask), values);
    }
    static void store(unsigned *to, Mask mask, unsigned value) {
        _mm256_maskstore_epi32(reinterpret_cast<int *>(to), _mm256_castps_si256(mask),
                               _mm256_set1_epi32(static_cast<int>(value)));
    }
};
#else
#error "user geometry is compared on processors with AVX2 or AVX-512 only"
#endif

// What the callbacks read.
struct Balls {
    // Three numbers each: as in the array, or along the curve.
    const float *centers;
    size_t count;
    float radius;
    // Spheres of a primitive.
    size_t group;
    unsigned geometry;
    // Along the curve: which sphere of the array each is.
    std::unique_ptr<float[]> sorted;
    std::unique_ptr<uint32_t[]> order;
};

void bounds_of(const RTCBoundsFunctionArguments *args) {
    const Balls &balls = *static_cast<const Balls *>(args->geometryUserPtr);
    const size_t first = args->primID * balls.group,
                 end = std::min(first + balls.group, balls.count);
    const float infinity = std::numeric_limits<float>::infinity();
    float low[3] = {infinity, infinity, infinity}, high[3] = {-infinity, -infinity, -infinity};
    for (size_t k = first; k < end; ++k) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], balls.centers[3 * k + axis] - balls.radius);
            high[axis] = std::max(high[axis], balls.centers[3 * k + axis] + balls.radius);
        }
    }
    *args->bounds_o = {low[0], low[1], low[2], 0, high[0], high[1], high[2], 0};
}

// The nearest of a primitive's spheres, for a packet of rays of unit length.
void intersect(const RTCIntersectFunctionNArguments *args) {
    const Balls &balls = *static_cast<const Balls *>(args->geometryUserPtr);
    if (args->N != Lanes::count)
        stop("Embree asks for packets of another width");
    auto &packet = *reinterpret_cast<Lanes::Packet *>(args->rayhit);
    auto &ray = packet.ray;
    const auto valid = Lanes::valid(args->valid);
    const auto dx = Lanes::load(ray.dir_x), dy = Lanes::load(ray.dir_y),
               dz = Lanes::load(ray.dir_z);
    const auto ox = Lanes::load(ray.org_x), oy = Lanes::load(ray.org_y),
               oz = Lanes::load(ray.org_z);
    const auto near = Lanes::load(ray.tnear), square = Lanes::all(balls.radius * balls.radius),
               zero = Lanes::all(0);
    auto far = Lanes::load(ray.tfar);
    const size_t first = args->primID * balls.group,
                 end = std::min(first + balls.group, balls.count);
    for (size_t k = first; k < end; ++k) {
        const float *center = balls.centers + 3 * k;
        const auto cx = Lanes::sub(Lanes::all(center[0]), ox),
                   cy = Lanes::sub(Lanes::all(center[1]), oy);
        const auto cz = Lanes::sub(Lanes::all(center[2]), oz);
        // The foot of the centre on the ray, and what is between them.
        const auto foot = Lanes::fma(cx, dx, Lanes::fma(cy, dy, Lanes::mul(cz, dz)));
        const auto px = Lanes::sub(cx, Lanes::mul(foot, dx)),
                   py = Lanes::sub(cy, Lanes::mul(foot, dy));
        const auto pz = Lanes::sub(cz, Lanes::mul(foot, dz));
        const auto rest =
            Lanes::sub(square, Lanes::fma(px, px, Lanes::fma(py, py, Lanes::mul(pz, pz))));
        auto hit = Lanes::least(valid, rest, zero);
        if (Lanes::none(hit))
            continue;
        const auto half = Lanes::root(rest);
        const auto front = Lanes::sub(foot, half), back = Lanes::sub(foot, Lanes::sub(zero, half));
        const auto t = Lanes::choose(Lanes::least(hit, front, near), front, back);
        hit = Lanes::less(Lanes::least(hit, t, near), t, far);
        if (Lanes::none(hit))
            continue;
        far = Lanes::choose(hit, t, far);
        Lanes::store(ray.tfar, hit, t);
        Lanes::store(packet.hit.primID, hit,
                     static_cast<unsigned>(balls.order ? balls.order[k] : k));
        Lanes::store(packet.hit.geomID, hit, balls.geometry);
    }
}

// Ten bits of a coordinate, three places apart.
uint32_t spread(uint32_t x) {
    x = (x | x << 16) & 0x030000ff;
    x = (x | x << 8) & 0x0300f00f;
    x = (x | x << 4) & 0x030c30c3;
    return (x | x << 2) & 0x09249249;
}

// Puts spheres in the order of a Morton curve of 30 bits: a radix sort in three rounds, on all
// cores.
void sort_along_curve(Balls &balls) {
    struct Key {
        uint32_t code, index;
    };
    const size_t count = balls.count, chunk = 1 << 16, chunks = (count + chunk - 1) / chunk;
    constexpr size_t digits = 1 << 10;
    std::unique_ptr<Key[]> keys(new Key[count]), others(new Key[count]);
    const auto each = [&](auto work) {
        tbb::parallel_for(size_t(0), chunks,
                          [&](size_t k) { work(k, k * chunk, std::min(count, (k + 1) * chunk)); });
    };
    // The box of the centres: of each chunk, and then of all.
    struct Box {
        float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    };
    std::vector<Box> boxes(chunks);
    each([&](size_t c, size_t first, size_t end) {
        Box box;
        for (size_t k = first; k < end; ++k) {
            for (int axis = 0; axis < 3; ++axis) {
                box.low[axis] = std::min(box.low[axis], balls.centers[3 * k + axis]);
                box.high[axis] = std::max(box.high[axis], balls.centers[3 * k + axis]);
            }
        }
        boxes[c] = box;
    });
    Box all;
    for (const Box &box : boxes) {
        for (int axis = 0; axis < 3; ++axis) {
            all.low[axis] = std::min(all.low[axis], box.low[axis]);
            all.high[axis] = std::max(all.high[axis], box.high[axis]);
        }
    }
    each([&](size_t, size_t first, size_t end) {
        for (size_t k = first; k < end; ++k) {
            uint32_t code = 0;
            for (int axis = 0; axis < 3; ++axis) {
                const float size = all.high[axis] - all.low[axis];
                const float place =
                    size > 0 ? (balls.centers[3 * k + axis] - all.low[axis]) / size * 1023.99f : 0;
                code |= spread(static_cast<uint32_t>(place)) << axis;
            }
            keys[k] = {code, static_cast<uint32_t>(k)};
        }
    });
    std::vector<size_t> starts(chunks * digits);
    for (int round = 0; round < 3; ++round) {
        const auto digit = [&](Key key) { return key.code >> 10 * round & (digits - 1); };
        std::fill(starts.begin(), starts.end(), 0);
        each([&](size_t c, size_t first, size_t end) {
            for (size_t k = first; k < end; ++k)
                ++starts[c * digits + digit(keys[k])];
        });
        size_t sum = 0;
        for (size_t d = 0; d < digits; ++d) {
            for (size_t c = 0; c < chunks; ++c) {
                const size_t here = starts[c * digits + d];
                starts[c * digits + d] = sum;
                sum += here;
            }
        }
        each([&](size_t c, size_t first, size_t end) {
            for (size_t k = first; k < end; ++k)
                others[starts[c * digits + digit(keys[k])]++] = keys[k];
        });
        keys.swap(others);
    }
    balls.sorted.reset(new float[3 * count]);
    balls.order.reset(new uint32_t[count]);
    each([&](size_t, size_t first, size_t end) {
        for (size_t k = first; k < end; ++k) {
            balls.order[k] = keys[k].index;
            std::memcpy(balls.sorted.get() + 3 * k, balls.centers + 3 * size_t(keys[k].index), 12);
        }
    });
    balls.centers = balls.sorted.get();
}

template <typename Packet> struct Calls;

template <> struct Calls<RTCRayHit16> {
    static constexpr unsigned across = 4, down = 4;
    static void trace(const int *valid, RTCScene scene, RTCIntersectContext *context,
                      RTCRayHit16 *packet) {
        rtcIntersect16(valid, scene, context, packet);
    }
};

template <> struct Calls<RTCRayHit8> {
    static constexpr unsigned across = 4, down = 2;
    static void trace(const int *valid, RTCScene scene, RTCIntersectContext *context,
                      RTCRayHit8 *packet) {
        rtcIntersect8(valid, scene, context, packet);
    }
};

template <typename Packet> void draw(RTCScene scene, const View &view, std::vector<int32_t> &ids) {
    constexpr unsigned across = Calls<Packet>::across, down = Calls<Packet>::down,
                       lanes = across * down, tile = 32;
    const unsigned pixels = view.pixels, tiles = (pixels + tile - 1) / tile;
    // What is the same in all packets: where each lane's ray begins from the first one's, and most
    // of a ray.
    alignas(64) double off[3][lanes];
    Packet blank;
    for (unsigned k = 0; k < lanes; ++k) {
        const double right = (k % across) * view.pitch,
                     up = -static_cast<double>(k / across) * view.pitch;
        const Vec place = right * view.right + up * view.up;
        off[0][k] = place.x, off[1][k] = place.y, off[2][k] = place.z;
        blank.ray.dir_x[k] = static_cast<float>(view.forward.x);
        blank.ray.dir_y[k] = static_cast<float>(view.forward.y);
        blank.ray.dir_z[k] = static_cast<float>(view.forward.z);
        blank.ray.tnear[k] = 0;
        blank.ray.tfar[k] = std::numeric_limits<float>::infinity();
        blank.ray.time[k] = 0;
        blank.ray.mask[k] = ~0u;
        blank.ray.id[k] = k;
        blank.ray.flags[k] = 0;
        blank.hit.primID[k] = ~0u;
        blank.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
    }
    tbb::parallel_for(
        tbb::blocked_range2d<unsigned>(0, tiles, 1, 0, tiles, 1), [&](const auto &range) {
            RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
            alignas(64) Packet packet = blank;
            alignas(64) int valid[lanes];
            for (unsigned y = range.rows().begin() * tile;
                 y < std::min(pixels, range.rows().end() * tile); y += down) {
                for (unsigned x = range.cols().begin() * tile;
                     x < std::min(pixels, range.cols().end() * tile); x += across) {
                    const double sx = (x + 0.5 - 0.5 * pixels) * view.pitch,
                                 sy = (0.5 * pixels - y - 0.5) * view.pitch;
                    const Vec from = view.origin + sx * view.right + sy * view.up;
                    for (unsigned k = 0; k < lanes; ++k) {
                        packet.ray.org_x[k] = static_cast<float>(from.x + off[0][k]);
                        packet.ray.org_y[k] = static_cast<float>(from.y + off[1][k]);
                        packet.ray.org_z[k] = static_cast<float>(from.z + off[2][k]);
                    }
                    for (unsigned k = 0; k < lanes; ++k) {
                        packet.ray.tfar[k] = std::numeric_limits<float>::infinity();
                        packet.hit.primID[k] = ~0u;
                        packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
                        valid[k] = x + k % across < pixels && y + k / across < pixels ? -1 : 0;
                    }
                    Calls<Packet>::trace(valid, scene, &context, &packet);
                    // No sphere is ~0u, which is -1.
                    for (unsigned row = 0; row < std::min(down, pixels - y); ++row) {
                        int32_t *to = ids.data() + static_cast<size_t>(y + row) * pixels + x;
                        std::memcpy(to, packet.hit.primID + row * across,
                                    4 * std::min(across, pixels - x));
                    }
                }
            }
        });
}

} // namespace

int main(int argc, char **argv) {
    if (argc != 18 && argc != 19)
        stop("see the head of its source for its 17 arguments");
    const Array centers = map_npy(argv[1]);
    const float radius = static_cast<float>(std::atof(argv[2]));
    const auto vec = [&](int at) {
        return Vec{std::atof(argv[at]), std::atof(argv[at + 1]), std::atof(argv[at + 2])};
    };
    const Vec forward = unit(vec(6));
    // Column i runs to the right as seen: view x up.
    const Vec right = unit(cross(forward, vec(9)));
    const unsigned pixels = static_cast<unsigned>(std::atoi(argv[13]));
    View view{vec(3), right, cross(right, forward), forward, std::atof(argv[12]) / pixels, pixels};
    const std::string given = argv[14], quality = argv[15];
    if (given != "points" && given != "spheres" && given != "groups")
        stop("points, spheres or groups, not " + given);
    const int frames = std::atoi(argv[17]);

    RTCDevice device = rtcNewDevice(nullptr);
    if (!device)
        stop("Embree has no device");
    RTCScene scene = rtcNewScene(device);
    const RTCBuildQuality build = quality == "low"    ? RTC_BUILD_QUALITY_LOW
                                  : quality == "high" ? RTC_BUILD_QUALITY_HIGH
                                                      : RTC_BUILD_QUALITY_MEDIUM;
    rtcSetSceneBuildQuality(scene, build);
    const size_t count = centers.count / 3;
    const float *from = reinterpret_cast<const float *>(centers.numbers);
    const bool own = given == "points";
    RTCGeometry geometry =
        rtcNewGeometry(device, own ? RTC_GEOMETRY_TYPE_SPHERE_POINT : RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryBuildQuality(geometry, build);
    Balls user{from, count, radius, given == "groups" ? size_t(8) : size_t(1), 0, nullptr, nullptr};
    if (own) {
        float *balls = static_cast<float *>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, count));
        if (count > 0 && !balls)
            stop("Embree has no memory for the spheres");
        tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 1 << 14), [&](const auto &range) {
            for (size_t k = range.begin(); k < range.end(); ++k) {
                std::memcpy(balls + 4 * k, from + 3 * k, 12);
                balls[4 * k + 3] = radius;
            }
        });
    } else {
        if (user.group > 1)
            sort_along_curve(user);
        rtcSetGeometryUserPrimitiveCount(
            geometry, static_cast<unsigned>((count + user.group - 1) / user.group));
        rtcSetGeometryUserData(geometry, &user);
        rtcSetGeometryBoundsFunction(
            geometry, [](const RTCBoundsFunctionArguments *args) { bounds_of(args); }, nullptr);
        rtcSetGeometryIntersectFunction(
            geometry, [](const RTCIntersectFunctionNArguments *args) { intersect(args); });
    }
    rtcCommitGeometry(geometry);
    user.geometry = rtcAttachGeometry(scene, geometry);
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE)
        stop("Embree could not build the scene");

    std::vector<int32_t> ids(static_cast<size_t>(pixels) * pixels);
    // User geometry is tested in the packets that its callback was built for.
    const bool native =
        rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
    const bool wide = own ? native : Lanes::count == 16;
    const auto frame = [&] {
        wide ? draw<RTCRayHit16>(scene, view, ids) : draw<RTCRayHit8>(scene, view, ids);
    };
    frame();
    write_ids(argv[16], ids, pixels);

    if (argc == 19) {
        const Array exact = map_npy(argv[18]);
        if (exact.count != ids.size())
            stop("the exact ids are of another size");
        const int32_t *truth = reinterpret_cast<const int32_t *>(exact.numbers);
        size_t differ = 0;
        for (size_t k = 0; k < ids.size(); ++k)
            differ += ids[k] != truth[k];
        std::printf("differ %zu of %zu pixels\n", differ, ids.size());
    }
    std::vector<double> walls, cpus;
    for (int k = 0; k < frames; ++k) {
        view.origin = view.origin + 1.37 * view.pitch * right;
        const double cpu = cpu_time();
        const auto begun = std::chrono::steady_clock::now();
        frame();
        walls.push_back(
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun)
                .count());
        cpus.push_back(cpu_time() - cpu);
    }
    if (!walls.empty())
        std::printf("frame_ms %.3f %.3f\n", median(walls), median(cpus));
    // The process ends: what it holds is given back by the system, sooner than piece by piece.
    std::fflush(stdout);
    std::_Exit(0);
}

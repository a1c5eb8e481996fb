// Draws the ids of spheres with Embree 3, for benches/peers.sh: the same arrays, the same parallel rays, the same output as
// `planisphere render --ids`.
//
//   embree CENTERS.npy RADIUS OX OY OZ VX VY VZ UX UY UZ WIDTH PIXELS low|medium|high IDS.npy FRAMES [EXACT.npy]
//
// CENTERS is float32 (N, 3), little-endian; all spheres have one RADIUS. The camera is orthographic at O, looks along V with
// U up, and sees WIDTH world units across a square picture of PIXELS. The build quality is Embree's. Rays go in packets of 16
// or 8, whichever this processor has natively, in blocks of neighbouring pixels, on all cores by TBB: what Embree's own
// documentation advises for coherent rays. With FRAMES > 0 so many more pictures are drawn with everything built, the camera
// 1.37 pixels aside each time, and the median milliseconds are printed,
// of wall time and of processor time. With EXACT the pixels that differ are counted.

#include <embree3/rtcore.h>

#include <fcntl.h>
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
#include <string>
#include <vector>

namespace {

[[noreturn]] void stop(const std::string& why) {
    std::fprintf(stderr, "embree: %s\n", why.c_str());
    std::exit(2);
}

// A mapped .npy file: where its numbers begin, and how many 4-byte numbers there are.
struct Array {
    const char* numbers;
    size_t count;
};

Array map_npy(const char* path) {
    const int file = open(path, O_RDONLY);
    struct stat data {};
    if (file < 0 || fstat(file, &data) != 0) stop(std::string("cannot read ") + path);
    const size_t size = static_cast<size_t>(data.st_size);
    if (size < 10) stop(std::string("not an array: ") + path);
    void* bytes = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
    if (bytes == MAP_FAILED) stop(std::string("cannot map ") + path);
    const char* start = static_cast<const char*>(bytes);
    uint16_t header = 0;
    std::memcpy(&header, start + 8, 2);
    if (std::memcmp(start, "\x93NUMPY\x01", 7) != 0 || 10u + header > size) stop(std::string("not an array: ") + path);
    return {start + 10 + header, (size - 10 - header) / 4};
}

void write_ids(const char* path, const std::vector<int32_t>& ids, unsigned pixels) {
    const std::string side = std::to_string(pixels);
    std::string dict = "{'descr': '<i4', 'fortran_order': False, 'shape': (" + side + ", " + side + "), }";
    dict.append(63 - (10 + dict.size()) % 64, ' ');
    dict.push_back('\n');
    const uint16_t length = static_cast<uint16_t>(dict.size());
    FILE* file = std::fopen(path, "wb");
    if (!file) stop(std::string("cannot write ") + path);
    bool fine = std::fwrite("\x93NUMPY\x01\x00", 1, 8, file) == 8;
    fine = fine && std::fwrite(&length, 2, 1, file) == 1 && std::fwrite(dict.data(), 1, dict.size(), file) == dict.size();
    fine = fine && std::fwrite(ids.data(), 4, ids.size(), file) == ids.size();
    if (std::fclose(file) != 0 || !fine) stop(std::string("cannot write ") + path);
}

// Milliseconds of processor time of all threads so far.
double cpu_time() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto milliseconds = [](const timeval& time) { return 1e3 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_usec); };
    return milliseconds(usage.ru_utime) + milliseconds(usage.ru_stime);
}

double median(std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

struct Vec {
    double x, y, z;
};

Vec operator*(double s, Vec v) { return {s * v.x, s * v.y, s * v.z}; }
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Vec unit(Vec v) { return 1 / std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z) * v; }

struct View {
    Vec origin, right, up, forward;
    double pitch;
    unsigned pixels;
};

template <typename Packet>
struct Calls;

template <>
struct Calls<RTCRayHit16> {
    static constexpr unsigned across = 4, down = 4;
    static void trace(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRayHit16* packet) {
        rtcIntersect16(valid, scene, context, packet);
    }
};

template <>
struct Calls<RTCRayHit8> {
    static constexpr unsigned across = 4, down = 2;
    static void trace(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRayHit8* packet) {
        rtcIntersect8(valid, scene, context, packet);
    }
};

template <typename Packet>
void draw(RTCScene scene, const View& view, std::vector<int32_t>& ids) {
    constexpr unsigned across = Calls<Packet>::across, down = Calls<Packet>::down, lanes = across * down;
    const unsigned pixels = view.pixels;
    tbb::parallel_for(tbb::blocked_range2d<unsigned>(0, (pixels + 31) / 32, 1, 0, (pixels + 31) / 32, 1), [&](const auto& tiles) {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        for (unsigned y = tiles.rows().begin() * 32; y < std::min(pixels, tiles.rows().end() * 32); y += down) {
            for (unsigned x = tiles.cols().begin() * 32; x < std::min(pixels, tiles.cols().end() * 32); x += across) {
                alignas(64) Packet packet;
                alignas(64) int valid[lanes];
                for (unsigned k = 0; k < lanes; ++k) {
                    const unsigned i = x + k % across, j = y + k / across;
                    valid[k] = i < pixels && j < pixels ? -1 : 0;
                    const double sx = (i + 0.5 - 0.5 * pixels) * view.pitch, sy = (0.5 * pixels - j - 0.5) * view.pitch;
                    const Vec from = view.origin + sx * view.right + sy * view.up;
                    packet.ray.org_x[k] = static_cast<float>(from.x);
                    packet.ray.org_y[k] = static_cast<float>(from.y);
                    packet.ray.org_z[k] = static_cast<float>(from.z);
                    packet.ray.dir_x[k] = static_cast<float>(view.forward.x);
                    packet.ray.dir_y[k] = static_cast<float>(view.forward.y);
                    packet.ray.dir_z[k] = static_cast<float>(view.forward.z);
                    packet.ray.tnear[k] = 0;
                    packet.ray.tfar[k] = std::numeric_limits<float>::infinity();
                    packet.ray.time[k] = 0;
                    packet.ray.mask[k] = ~0u;
                    packet.ray.id[k] = k;
                    packet.ray.flags[k] = 0;
                    packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
                }
                Calls<Packet>::trace(valid, scene, &context, &packet);
                for (unsigned k = 0; k < lanes; ++k) {
                    const unsigned i = x + k % across, j = y + k / across;
                    if (!valid[k]) continue;
                    const bool hit = packet.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
                    ids[static_cast<size_t>(j) * pixels + i] = hit ? static_cast<int32_t>(packet.hit.primID[k]) : -1;
                }
            }
        }
    });
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 17 && argc != 18) stop("see the head of its source for its 16 arguments");
    const Array centers = map_npy(argv[1]);
    const float radius = static_cast<float>(std::atof(argv[2]));
    const auto vec = [&](int at) { return Vec{std::atof(argv[at]), std::atof(argv[at + 1]), std::atof(argv[at + 2])}; };
    const Vec forward = unit(vec(6));
    // Column i runs to the right as seen: view x up.
    const Vec right = unit(cross(forward, vec(9)));
    const unsigned pixels = static_cast<unsigned>(std::atoi(argv[13]));
    View view{vec(3), right, cross(right, forward), forward, std::atof(argv[12]) / pixels, pixels};
    const std::string quality = argv[14];
    const int frames = std::atoi(argv[16]);

    RTCDevice device = rtcNewDevice(nullptr);
    if (!device) stop("Embree has no device");
    RTCScene scene = rtcNewScene(device);
    const RTCBuildQuality build = quality == "low"    ? RTC_BUILD_QUALITY_LOW
                                  : quality == "high" ? RTC_BUILD_QUALITY_HIGH
                                                      : RTC_BUILD_QUALITY_MEDIUM;
    rtcSetSceneBuildQuality(scene, build);
    const size_t count = centers.count / 3;
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    rtcSetGeometryBuildQuality(geometry, build);
    float* balls = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, count));
    if (count > 0 && !balls) stop("Embree has no memory for the spheres");
    const float* from = reinterpret_cast<const float*>(centers.numbers);
    tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 1 << 14), [&](const auto& range) {
        for (size_t k = range.begin(); k < range.end(); ++k) {
            std::memcpy(balls + 4 * k, from + 3 * k, 12);
            balls[4 * k + 3] = radius;
        }
    });
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) stop("Embree could not build the scene");

    std::vector<int32_t> ids(static_cast<size_t>(pixels) * pixels);
    const bool wide = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
    const auto frame = [&] { wide ? draw<RTCRayHit16>(scene, view, ids) : draw<RTCRayHit8>(scene, view, ids); };
    frame();
    write_ids(argv[15], ids, pixels);

    if (argc == 18) {
        const Array exact = map_npy(argv[17]);
        if (exact.count != ids.size()) stop("the exact ids are of another size");
        const int32_t* truth = reinterpret_cast<const int32_t*>(exact.numbers);
        size_t differ = 0;
        for (size_t k = 0; k < ids.size(); ++k) differ += ids[k] != truth[k];
        std::printf("differ %zu of %zu pixels\n", differ, ids.size());
    }
    std::vector<double> walls, cpus;
    for (int k = 0; k < frames; ++k) {
        view.origin = view.origin + 1.37 * view.pitch * right;
        const double cpu = cpu_time();
        const auto begun = std::chrono::steady_clock::now();
        frame();
        walls.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count());
        cpus.push_back(cpu_time() - cpu);
    }
    if (!walls.empty()) std::printf("frame_ms %.3f %.3f\n", median(walls), median(cpus));
    // The process ends: what it holds is given back by the system, sooner than piece by piece.
    std::fflush(stdout);
    std::_Exit(0);
}

// One frame of two sensors with Embree: all rays, sixteen at a time, against trees of bodies that are refitted. The static hall is
// known for every ray beforehand, as ours is, and ends the ray; that look-up, the rays themselves and the posed bodies cost the
// peer nothing. The arguments are the folder and, for bodies that stand still through the frame, "still".

#include <algorithm>
#include <cmath>

#include "embree.hpp"

constexpr unsigned LANES = 16, ACROSS = 8, DOWN = 2;

// The rays of one sensor in tiles of neighbours, ready to be cast.
struct Rays {
    size_t beams, columns;
    std::vector<RTCRayHit16> prepared, cast;
    // By tile and lane: place in the image, beam after beam.
    std::vector<uint32_t> pixels;
    Array<float> ours_m, hall_m;
    std::vector<float> range_m;

    Rays(const std::string &folder, const std::string &sensor)
        : ours_m(read<float>(folder, "ours_" + sensor)), hall_m(read<float>(folder, "hall_" + sensor)) {
        const auto rays = read<float>(folder, "rays_" + sensor);
        beams = rays.shape[0], columns = rays.shape[1];
        range_m.resize(beams * columns);
        for (size_t b = 0; b < beams; b += DOWN)
            for (size_t c = 0; c < columns; c += ACROSS) add_tile(rays.values, b, c);
        cast = prepared;
    }

  private:
    void add_tile(const std::vector<float> &rays, size_t b, size_t c) {
        RTCRayHit16 tile;
        std::memset(&tile, 0, sizeof tile);
        for (unsigned lane = 0; lane < LANES; lane++) {
            // Past the last column the last ray is cast again.
            const size_t column = std::min(c + lane % ACROSS, columns - 1), beam = b + lane / ACROSS;
            const size_t pixel = beam * columns + column;
            const float *ray = &rays[6 * pixel];
            tile.ray.org_x[lane] = ray[0], tile.ray.org_y[lane] = ray[1], tile.ray.org_z[lane] = ray[2];
            tile.ray.dir_x[lane] = ray[3], tile.ray.dir_y[lane] = ray[4], tile.ray.dir_z[lane] = ray[5];
            tile.ray.tfar[lane] = hall_m.values[pixel] > 0 ? hall_m.values[pixel] : INFINITY;
            tile.ray.mask[lane] = ~0u;
            tile.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
            tile.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
            pixels.push_back(uint32_t(pixel));
        }
        prepared.push_back(tile);
    }
};

static void trace(RTCScene scene, Rays &rays) {
    alignas(64) int all[LANES];
    std::fill(all, all + LANES, -1);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (size_t tile = 0; tile < rays.prepared.size(); tile++) {
        RTCRayHit16 &cast = rays.cast[tile];
        const RTCRayHit16 &prepared = rays.prepared[tile];
        // Only these are changed by a cast that read them.
        std::memcpy(cast.ray.tfar, prepared.ray.tfar, sizeof cast.ray.tfar);
        std::memcpy(cast.hit.geomID, prepared.hit.geomID, sizeof cast.hit.geomID);
        rtcIntersect16(all, scene, &context, &cast);
        for (unsigned lane = 0; lane < LANES; lane++)
            rays.range_m[rays.pixels[LANES * tile + lane]] = cast.ray.tfar[lane];
    }
}

// What a sensor would add and how it would send it: noise, lost returns, and packets of twelve columns in Velodyne's format.
class Sender {
  public:
    void send(const Rays &rays) {
        const size_t packets = (rays.columns + COLUMNS - 1) / COLUMNS;
        bytes.resize(packets * PACKET);
        for (size_t c = 0; c < rays.columns; c++) {
            uint8_t *at = &bytes[c / COLUMNS * PACKET + c % COLUMNS * (4 + 3 * rays.beams)];
            const uint16_t azimuth = uint16_t(c * 36000 / rays.columns);
            at[0] = 0xff, at[1] = 0xee;
            std::memcpy(at + 2, &azimuth, 2);
            at += 4;
            for (size_t b = 0; b < rays.beams; b++, at += 3) {
                const uint16_t units = uint16_t(measured_m(rays.range_m[b * rays.columns + c]) * 500 + 0.5f);
                std::memcpy(at, &units, 2);
                at[2] = 20;
            }
        }
    }

  private:
    static constexpr size_t COLUMNS = 12, PACKET = 1206;

    float measured_m(float range_m) {
        // Four even numbers of 16 bits make one that is nearly normal: much cheaper than a better one.
        const uint64_t z = next();
        const float sum = float(z & 0xffff) + float(z >> 16 & 0xffff) + float(z >> 32 & 0xffff) + float(z >> 48);
        const float noisy_m = range_m + 0.02f * (sum - 131070.f) / 37837.f;
        const bool lost = (next() >> 40) < uint64_t(0.02 * (1 << 24));
        return lost || !(noisy_m >= 0.5f && noisy_m <= 50.f) ? 0.f : noisy_m;
    }

    // SplitMix64.
    uint64_t next() {
        uint64_t z = state += 0x9e3779b97f4a7c15;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
        z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
        return z ^ (z >> 31);
    }

    uint64_t state = 1;
    std::vector<uint8_t> bytes;
};

// How many links from access points to devices are blocked by others.
static int blocked(RTCScene scene, const std::vector<double> &access_points_m, const std::vector<double> &devices_m) {
    int blocked = 0;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (size_t ap = 0; ap < access_points_m.size(); ap += 3)
        for (size_t ue = 0; ue < devices_m.size(); ue += 3) {
            RTCRay ray;
            std::memset(&ray, 0, sizeof ray);
            const double *from = &access_points_m[ap], *to = &devices_m[ue];
            ray.org_x = from[0], ray.org_y = from[1], ray.org_z = from[2];
            ray.dir_x = to[0] - from[0], ray.dir_y = to[1] - from[1], ray.dir_z = to[2] - from[2];
            ray.tfar = 1;
            ray.mask = ~(1u << (ue / 3));
            rtcOccluded1(scene, &context, &ray);
            blocked += ray.tfar < 0;
        }
    return blocked;
}

int main(int count, char **words) {
    if (count < 2) give_up("simulate_embree FOLDER [still]");
    const std::string folder = words[1];
    const bool still = count > 2 && std::string(words[2]) == "still";
    const Surfaces surfaces(folder);
    std::vector<Rays> rays;
    for (const char *sensor : {"0", "1"}) rays.emplace_back(folder, sensor);
    const auto end_m = read<float>(folder, "end");
    const auto access_points_m = read<double>(folder, "access_points").values;
    const auto devices_m = read<double>(folder, "devices").values;
    std::vector<Array<float>> posed_m;
    for (const char *name : {"seen_0", "seen_1"}) posed_m.push_back(read<float>(folder, still ? "middle" : name));

    RTCDevice device = one_thread();
    // Trees are built once, for bodies as they stand at another instant than those that are seen.
    std::vector<Crowd> crowds;
    for (size_t sensor = 0; sensor < rays.size(); sensor++) crowds.emplace_back(device, surfaces, end_m);
    Crowd at_end(device, surfaces, posed_m[0]);
    const auto all_rays = [&] {
        // Bodies that stand still are the same for both sensors.
        for (size_t sensor = 0; sensor < rays.size(); sensor++) {
            if (sensor == 0 || !still) crowds[sensor].pose(posed_m[sensor]);
            trace(crowds[still ? 0 : sensor].scene, rays[sensor]);
        }
    };
    const auto rays_ms = times(40, all_rays);
    double agree = 0, counted = 0, on_bodies = 0;
    for (const Rays &of_sensor : rays)
        for (size_t pixel = 0; pixel < of_sensor.range_m.size(); pixel++) {
            const float ours_m = of_sensor.ours_m.values[pixel], hall_m = of_sensor.hall_m.values[pixel];
            const float found_m = of_sensor.range_m[pixel];
            const bool on_body = found_m < hall_m - 0.003f;
            on_bodies += on_body;
            // Of the rays on a body by either side: a millimetre, and what the packet rounds off.
            if (on_body || ours_m < hall_m - 0.003f) counted++, agree += std::abs(found_m - ours_m) <= 0.002f;
        }
    Sender sender;
    int blocked_links = 0;
    const auto all_ms = times(40, [&] {
        all_rays();
        for (const Rays &of_sensor : rays) sender.send(of_sensor);
        at_end.pose(end_m);
        blocked_links = blocked(at_end.scene, access_points_m, devices_m);
    });
    Answer answer;
    answer.add("rays", rays_ms, {{"body rays", on_bodies}, {"agree", agree / counted}});
    answer.add("all", all_ms, {{"body rays", on_bodies}, {"blocked links", double(blocked_links)}});
    answer.print();
}

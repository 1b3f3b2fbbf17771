// How likely links are lost, with Embree: in every sample and at every step each body is placed, upright, and rays go from the
// access point to everybody. A link that is lost in a sample is not asked for again at later steps. Samples are drawn and the
// trees of bodies built beforehand. The arguments are the folder and, for bodies that are asked one by one and only where they
// stand near a ray, in place of a scene of placed bodies, "culled".

#include <algorithm>
#include <cmath>
#include <numeric>

#include "embree.hpp"

constexpr unsigned LANES = 16;

// Where somebody stands.
struct Place {
    float x_m, y_m, cos, sin;
};

struct Question {
    size_t people, samples, steps;
    std::vector<Place> places;
    std::vector<double> device_heights_m, access_point_m, ours;

    explicit Question(const std::string &folder)
        : device_heights_m(read<double>(folder, "device_heights").values),
          access_point_m(read<double>(folder, "access_point").values), ours(read<double>(folder, "ours").values) {
        const auto drawn = read<float>(folder, "samples");
        people = drawn.shape[0], samples = drawn.shape[1], steps = drawn.shape[2];
        for (size_t i = 0; i < drawn.values.size(); i += 3) {
            const float heading_rad = drawn.values[i + 2];
            places.push_back({drawn.values[i], drawn.values[i + 1], std::cos(heading_rad), std::sin(heading_rad)});
        }
    }

    const Place &at(size_t person, size_t sample, size_t step) const {
        return places[(person * samples + sample) * steps + step];
    }
};

// In how many samples each link was lost by each step.
struct Lost {
    std::vector<uint8_t> lost;
    std::vector<double> p;

    void begin(const Question &question) {
        lost.assign(question.people * question.samples, 0);
        p.assign(question.people * question.steps, 0);
    }

    void count(const Question &question, size_t step) {
        for (size_t person = 0; person < question.people; person++) {
            const auto first = lost.begin() + person * question.samples;
            p[person * question.steps + step] = std::accumulate(first, first + question.samples, 0.0) / question.samples;
        }
    }
};

// A scene of bodies, each an instance of its own tree; the tree over them is built for every sample and step.
class Placed {
  public:
    Placed(RTCDevice device, const std::vector<RTCScene> &bodies) : scene(rtcNewScene(device)) {
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_DYNAMIC);
        rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_LOW);
        for (size_t person = 0; person < bodies.size(); person++) {
            RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
            rtcSetGeometryInstancedScene(instance, bodies[person]);
            rtcSetGeometryMask(instance, 1u << person);
            rtcCommitGeometry(instance);
            rtcAttachGeometryByID(scene, instance, unsigned(person));
            instances.push_back(instance);
        }
    }

    void ask(const Question &question, Lost &links) {
        links.begin(question);
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        for (size_t step = 0; step < question.steps; step++) {
            for (size_t sample = 0; sample < question.samples; sample++) {
                place(question, sample, step);
                for (size_t first = 0; first < question.people; first += LANES)
                    cast(question, links, context, sample, step, first);
            }
            links.count(question, step);
        }
    }

  private:
    void place(const Question &question, size_t sample, size_t step) {
        for (size_t person = 0; person < question.people; person++) {
            const Place &at = question.at(person, sample, step);
            const float rows[12] = {at.cos, -at.sin, 0, at.x_m, at.sin, at.cos, 0, at.y_m, 0, 0, 1, 0};
            rtcSetGeometryTransform(instances[person], 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, rows);
            rtcCommitGeometry(instances[person]);
        }
        rtcCommitScene(scene);
    }

    void cast(const Question &question, Lost &links, RTCIntersectContext &context, size_t sample, size_t step, size_t first) {
        alignas(64) int valid[LANES] = {};
        for (unsigned lane = 0; lane < LANES && first + lane < question.people; lane++) {
            const size_t person = first + lane;
            if (links.lost[person * question.samples + sample]) continue;
            valid[lane] = -1;
            const Place &at = question.at(person, sample, step);
            const auto &ap_m = question.access_point_m;
            rays.org_x[lane] = ap_m[0], rays.org_y[lane] = ap_m[1], rays.org_z[lane] = ap_m[2];
            rays.dir_x[lane] = at.x_m - ap_m[0], rays.dir_y[lane] = at.y_m - ap_m[1];
            rays.dir_z[lane] = question.device_heights_m[person] - ap_m[2];
            rays.tnear[lane] = 0, rays.tfar[lane] = 1, rays.time[lane] = 0;
            rays.mask[lane] = ~(1u << person), rays.flags[lane] = 0, rays.id[lane] = lane;
        }
        rtcOccluded16(valid, scene, &context, &rays);
        for (unsigned lane = 0; lane < LANES; lane++)
            if (valid[lane] && rays.tfar[lane] < 0) links.lost[(first + lane) * question.samples + sample] = 1;
    }

    RTCScene scene;
    std::vector<RTCGeometry> instances;
    // Embree looks at lanes that are not asked about, too, on processors without AVX-512, and takes no ray that is no number.
    RTCRay16 rays = {};
};

// Each body's own tree is asked, in the body's frame, by those rays alone that pass within its reach.
class Culled {
  public:
    Culled(const std::vector<RTCScene> &bodies, const std::vector<float> &reach_m) : bodies(bodies), reach_m(reach_m) {}

    void ask(const Question &question, Lost &links) {
        links.begin(question);
        for (size_t step = 0; step < question.steps; step++) {
            for (size_t person = 0; person < question.people; person++)
                for (size_t other = 0; other < question.people; other++)
                    if (other != person) ask_one(question, links, step, person, other);
            links.count(question, step);
        }
    }

  private:
    void ask_one(const Question &question, Lost &links, size_t step, size_t person, size_t other) {
        const float ap_x = question.access_point_m[0], ap_y = question.access_point_m[1];
        const float reach2 = reach_m[other] * reach_m[other];
        uint8_t *lost = &links.lost[person * question.samples];
        for (size_t sample = 0; sample < question.samples; sample++) {
            const Place &to = question.at(person, sample, step), &by = question.at(other, sample, step);
            const float way_x = to.x_m - ap_x, way_y = to.y_m - ap_y;
            const float by_x = by.x_m - ap_x, by_y = by.y_m - ap_y;
            const float share = std::clamp((by_x * way_x + by_y * way_y) / (way_x * way_x + way_y * way_y), 0.f, 1.f);
            const float off_x = by_x - share * way_x, off_y = by_y - share * way_y;
            if (lost[sample] || off_x * off_x + off_y * off_y > reach2) continue;
            const float ap_z = question.access_point_m[2];
            rays.org_x[count] = -(by_x * by.cos + by_y * by.sin), rays.org_y[count] = by_x * by.sin - by_y * by.cos;
            rays.org_z[count] = ap_z;
            rays.dir_x[count] = way_x * by.cos + way_y * by.sin, rays.dir_y[count] = way_y * by.cos - way_x * by.sin;
            rays.dir_z[count] = question.device_heights_m[person] - ap_z;
            rays.tnear[count] = 0, rays.tfar[count] = 1, rays.time[count] = 0;
            rays.mask[count] = ~0u, rays.flags[count] = 0, rays.id[count] = 0;
            sample_of[count++] = sample;
            if (count == LANES) cast(other, lost);
        }
        if (count > 0) cast(other, lost);
    }

    void cast(size_t other, uint8_t *lost) {
        alignas(64) int valid[LANES];
        for (unsigned lane = 0; lane < LANES; lane++) valid[lane] = lane < count ? -1 : 0;
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcOccluded16(valid, bodies[other], &context, &rays);
        for (unsigned lane = 0; lane < count; lane++)
            if (rays.tfar[lane] < 0) lost[sample_of[lane]] = 1;
        count = 0;
    }

    const std::vector<RTCScene> &bodies;
    const std::vector<float> &reach_m;
    RTCRay16 rays = {};
    size_t sample_of[LANES];
    unsigned count = 0;
};

int main(int count, char **words) {
    if (count < 2) give_up("links_embree FOLDER [culled]");
    const std::string folder = words[1];
    const Surfaces surfaces(folder);
    const Question question(folder);
    const auto upright_m = read<float>(folder, "upright").values;
    RTCDevice device = one_thread();
    std::vector<RTCScene> bodies;
    std::vector<float> reach_m;
    size_t first = 0;
    for (size_t body = 0; body < surfaces.bodies(); body++) {
        float *vertices_m, reach = 0;
        RTCGeometry geometry = body_geometry(device, surfaces, body, &vertices_m);
        const size_t values = 3 * surfaces.vertices_of(body);
        std::memcpy(vertices_m, &upright_m[first], values * sizeof(float));
        for (size_t i = first; i < first + values; i += 3) reach = std::max(reach, std::hypot(upright_m[i], upright_m[i + 1]));
        first += values;
        rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
        rtcCommitGeometry(geometry);
        bodies.push_back(rtcNewScene(device));
        rtcSetSceneBuildQuality(bodies.back(), RTC_BUILD_QUALITY_HIGH);
        rtcAttachGeometry(bodies.back(), geometry);
        rtcCommitScene(bodies.back());
        reach_m.push_back(reach);
    }
    Placed placed(device, bodies);
    Culled culled(bodies, reach_m);
    const bool is_culled = count > 2 && std::string(words[2]) == "culled";
    Lost links;
    const auto ms = times(100, [&] { is_culled ? culled.ask(question, links) : placed.ask(question, links); });
    double at_first = 0, at_last = 0, apart = 0;
    for (size_t person = 0; person < question.people; person++) {
        const size_t link = person * question.steps, last = link + question.steps - 1;
        at_first += links.p[link] / question.people, at_last += links.p[last] / question.people;
        apart += std::abs(links.p[last] - question.ours[last]) / question.people;
    }
    Answer answer;
    answer.add("64 samples, 9 steps", ms,
               {{"links", double(question.people)}, {"p 100 ms", at_first}, {"p 900 ms", at_last}, {"apart", apart}});
    answer.print();
}

// Bodies in Embree, for the peers that cast rays at them.
#pragma once

#include <cstring>

#include <embree3/rtcore.h>
#include <immintrin.h>

#include "exchange.hpp"

// Triangles of all bodies, and how many vertices and triangles each of them has.
struct Surfaces {
    Array<uint32_t> triangles, counts;

    explicit Surfaces(const std::string &folder)
        : triangles(read<uint32_t>(folder, "triangles")), counts(read<uint32_t>(folder, "counts")) {}

    size_t bodies() const { return counts.shape[0]; }
    size_t vertices_of(size_t body) const { return counts.values[2 * body]; }
    size_t triangles_of(size_t body) const { return counts.values[2 * body + 1]; }
};

inline RTCDevice one_thread() {
    // Denormal numbers are slow, and nothing here needs them.
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    RTCDevice device = rtcNewDevice("threads=1,user_threads=1");
    if (!device) give_up("Embree found no device");
    return device;
}

// A geometry with the triangles of a body and room for its vertices.
inline RTCGeometry body_geometry(RTCDevice device, const Surfaces &surfaces, size_t body, float **vertices_m) {
    size_t first = 0;
    for (size_t before = 0; before < body; before++) first += surfaces.triangles_of(before);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    *vertices_m = static_cast<float *>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), surfaces.vertices_of(body)));
    void *corners = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t),
                                            surfaces.triangles_of(body));
    std::memcpy(corners, &surfaces.triangles.values[3 * first], surfaces.triangles_of(body) * 3 * sizeof(uint32_t));
    return geometry;
}

// People in one scene: a tree for each body, refitted when the body moves, and a small one over all of them.
class Crowd {
  public:
    Crowd(RTCDevice device, const Surfaces &surfaces, const Array<float> &posed_m) : surfaces(surfaces) {
        scene = rtcNewScene(device);
        // Of the combinations that Embree takes this is the fastest: it refits only if the scene's quality is said to be low, and
        // compact trees, which refer to vertices in place of holding them, are refitted in a third of the time.
        rtcSetSceneFlags(scene, FLAGS);
        rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_LOW);
        for (size_t body = 0; body < surfaces.bodies(); body++) {
            vertices_m.push_back(nullptr);
            RTCGeometry geometry = body_geometry(device, surfaces, body, &vertices_m.back());
            rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_REFIT);
            rtcSetGeometryMask(geometry, 1u << (body % 32));
            rtcAttachGeometryByID(scene, geometry, unsigned(body));
            geometries.push_back(geometry);
        }
        pose(posed_m);
    }

    void pose(const Array<float> &posed_m) {
        size_t first = 0;
        for (size_t body = 0; body < surfaces.bodies(); body++) {
            const size_t count = 3 * surfaces.vertices_of(body);
            std::memcpy(vertices_m[body], &posed_m.values[first], count * sizeof(float));
            rtcUpdateGeometryBuffer(geometries[body], RTC_BUFFER_TYPE_VERTEX, 0);
            rtcCommitGeometry(geometries[body]);
            first += count;
        }
        rtcCommitScene(scene);
    }

    RTCScene scene;

  private:
    static constexpr RTCSceneFlags FLAGS = RTCSceneFlags(int(RTC_SCENE_FLAG_DYNAMIC) | int(RTC_SCENE_FLAG_COMPACT));

    const Surfaces &surfaces;
    std::vector<float *> vertices_m;
    std::vector<RTCGeometry> geometries;
};

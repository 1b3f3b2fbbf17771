// Background and clusters with PCL, by the method of hdl_people_tracking: the cloud is thinned to voxels of 0.1 m, points in
// voxels of 0.2 m that the empty hall occupies are left out, and the rest is clustered with heights divided by a hundred.
// The arguments are the folder and, for the cloud as it is, "whole".

#include <algorithm>
#include <cmath>
#include <optional>

#include <pcl/common/centroid.h>
#include <pcl/common/common.h>
#include <pcl/common/transforms.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>

#include "exchange.hpp"

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

// What one sensor saw, and where it hangs.
struct Seen {
    Cloud::Ptr cloud;
    Eigen::Matrix4f site_from_sensor;
};

static Seen seen(const std::string &folder, const std::string &name, int sensor) {
    const auto points = read<float>(folder, name + "_" + std::to_string(sensor));
    const auto pose = read<float>(folder, "site_from_sensor_" + std::to_string(sensor));
    Seen seen{Cloud::Ptr(new Cloud), Eigen::Map<const Eigen::Matrix<float, 4, 4, Eigen::RowMajor>>(pose.values.data())};
    for (size_t i = 0; i < points.values.size(); i += 3)
        seen.cloud->emplace_back(points.values[i], points.values[i + 1], points.values[i + 2]);
    return seen;
}

static Cloud::Ptr together(const std::vector<Seen> &sensors) {
    Cloud::Ptr all(new Cloud), one(new Cloud);
    for (const Seen &sensor : sensors) {
        pcl::transformPointCloud(*sensor.cloud, *one, sensor.site_from_sensor);
        *all += *one;
    }
    return all;
}

// How many points of the empty hall lie in each voxel.
class Occupied {
  public:
    explicit Occupied(const Cloud &empty) {
        pcl::PointXYZ most;
        pcl::getMinMax3D(empty, least, most);
        const float extent[3] = {most.x - least.x, most.y - least.y, most.z - least.z};
        for (int i = 0; i < 3; i++) size[i] = int(extent[i] / EDGE_M) + 1;
        counts.resize(size_t(size[0]) * size[1] * size[2]);
        for (const auto &point : empty)
            if (uint8_t &count = counts[*voxel(point)]; count < 255) count++;
    }

    bool is_new(const pcl::PointXYZ &point) const {
        const auto at = voxel(point);
        return !at || counts[*at] < POINTS_MIN;
    }

  private:
    static constexpr float EDGE_M = 0.2f;
    static constexpr int POINTS_MIN = 2;

    std::optional<size_t> voxel(const pcl::PointXYZ &point) const {
        const int x = int(std::floor((point.x - least.x) * (1 / EDGE_M)));
        const int y = int(std::floor((point.y - least.y) * (1 / EDGE_M)));
        const int z = int(std::floor((point.z - least.z) * (1 / EDGE_M)));
        if (x < 0 || y < 0 || z < 0 || x >= size[0] || y >= size[1] || z >= size[2]) return std::nullopt;
        return x + size_t(size[0]) * (y + size_t(size[1]) * z);
    }

    pcl::PointXYZ least;
    int size[3];
    std::vector<uint8_t> counts;
};

// A person as the clusters show one: the middle in plan view.
struct Person {
    float x_m, y_m;
};

static Cloud::Ptr foreground(const std::vector<Seen> &sensors, const Occupied &occupied, bool thin) {
    Cloud::Ptr cloud = together(sensors), foreground(new Cloud);
    if (thin) {
        Cloud::Ptr thinned(new Cloud);
        pcl::VoxelGrid<pcl::PointXYZ> grid;
        grid.setLeafSize(0.1f, 0.1f, 0.1f);
        grid.setInputCloud(cloud);
        grid.filter(*thinned);
        cloud = thinned;
    }
    for (const auto &point : *cloud)
        if (occupied.is_new(point)) foreground->push_back(point);
    return foreground;
}

using Clusters = std::vector<pcl::PointIndices>;

static Clusters clusters(const Cloud &foreground) {
    Clusters clusters;
    if (foreground.empty()) return clusters;
    Cloud::Ptr flat(new Cloud(foreground));
    for (auto &point : *flat) point.z *= 0.01f;
    pcl::search::KdTree<pcl::PointXYZ>::Ptr tree(new pcl::search::KdTree<pcl::PointXYZ>);
    tree->setInputCloud(flat);
    pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
    extraction.setClusterTolerance(0.2);
    extraction.setMinClusterSize(16);
    extraction.setMaxClusterSize(100000);
    extraction.setSearchMethod(tree);
    extraction.setInputCloud(flat);
    extraction.extract(clusters);
    return clusters;
}

// Of each cluster the middle and the box, with the sizes that the method takes for a person's.
static std::vector<Person> people(const Cloud &foreground, const Clusters &clusters, bool only_of_size) {
    std::vector<Person> people;
    for (const auto &indices : clusters) {
        Eigen::Vector4f middle, least, most;
        pcl::compute3DCentroid(foreground, indices, middle);
        pcl::getMinMax3D(foreground, indices, least, most);
        const Eigen::Vector4f size = most - least;
        const auto within = [](float m, float low, float high) { return m >= low && m <= high; };
        if (!only_of_size || (within(size.x(), 0.2f, 1.0f) && within(size.y(), 0.2f, 1.0f) && within(size.z(), 0.3f, 2.0f)))
            people.push_back({middle.x(), middle.y()});
    }
    return people;
}

static Answer::Found found(const std::vector<double> &truth, const std::vector<Person> &people) {
    double near = 0;
    for (size_t i = 0; i < truth.size(); i += 2)
        near += std::any_of(people.begin(), people.end(), [&](const Person &person) {
            return std::hypot(person.x_m - truth[i], person.y_m - truth[i + 1]) < 0.5;
        });
    return {{"people", near}, {"groups", double(people.size())}};
}

int main(int count, char **words) {
    if (count < 2) give_up("background_pcl FOLDER [whole]");
    const std::string folder = words[1];
    const bool thin = !(count > 2 && std::string(words[2]) == "whole");
    const Occupied occupied(*together({seen(folder, "empty", 0), seen(folder, "empty", 1)}));
    Answer answer;
    for (const std::string number : {"10", "100"}) {
        const std::vector<Seen> sensors{seen(folder, "cloud_" + number, 0), seen(folder, "cloud_" + number, 1)};
        const auto truth = read<double>(folder, "truth_" + number).values;
        Cloud::Ptr points;
        Clusters groups;
        std::vector<Person> sized;
        const auto background_ms = times(20, [&] { points = foreground(sensors, occupied, thin); });
        const auto clusters_ms = times(20, [&] {
            points = foreground(sensors, occupied, thin);
            groups = clusters(*points);
        });
        const auto detections_ms = times(20, [&] {
            points = foreground(sensors, occupied, thin);
            groups = clusters(*points);
            sized = people(*points, groups, true);
        });
        answer.add(number + " people, background", background_ms, {{"points", double(points->size())}});
        answer.add(number + " people, clusters", clusters_ms, found(truth, people(*points, groups, false)));
        answer.add(number + " people, detections", detections_ms, found(truth, sized));
    }
    answer.print();
}

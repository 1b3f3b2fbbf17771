// What a peer in C++ reads and writes: arrays as NumPy files, times as JSON; the other side is src/bin/peers/exchange.rs.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

// Says on one line why the peer cannot go on; run.py prints it as the reason why a row is skipped.
[[noreturn]] inline void give_up(const std::string &why) {
    std::fprintf(stderr, "%s\n", why.c_str());
    std::exit(1);
}

// An array of a NumPy file, row after row.
template <class T> struct Array {
    std::vector<size_t> shape;
    std::vector<T> values;
};

// Reads NAME.npy of format 1.0, whose values must be of type T: float, double or uint32_t.
template <class T> Array<T> read(const std::string &folder, const std::string &name) {
    const char *kind = sizeof(T) == 8 ? "<f8" : T(0.5) > T(0) ? "<f4" : "<u4";
    std::ifstream file(folder + "/" + name + ".npy", std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    if (bytes.size() < 10) give_up(name + ".npy is missing");
    const size_t head = 10 + uint8_t(bytes[8]) + 256 * uint8_t(bytes[9]);
    const std::string said = bytes.substr(10, head - 10);
    if (said.find(kind) == std::string::npos) give_up(name + ".npy holds another type than " + kind);
    Array<T> array;
    size_t count = 1;
    const char *at = said.c_str() + said.find('(', said.find("shape")) + 1;
    for (char *end; *at != ')'; at = end + (*end == ','), at += *at == ' ') {
        array.shape.push_back(std::strtoull(at, &end, 10));
        count *= array.shape.back();
    }
    if (bytes.size() != head + count * sizeof(T)) give_up(name + ".npy is of another size than it says");
    const T *first = reinterpret_cast<const T *>(bytes.data() + head);
    array.values.assign(first, first + count);
    return array;
}

// Wall times in ms of so many runs, after one that is not counted.
template <class Work> std::vector<double> times(int tries, Work work) {
    std::vector<double> ms;
    for (int i = 0; i <= tries; i++) {
        const auto from = std::chrono::steady_clock::now();
        work();
        const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - from;
        if (i > 0) ms.push_back(took.count());
    }
    return ms;
}

// The cases of a row, printed as one line.
class Answer {
  public:
    using Found = std::vector<std::pair<std::string, double>>;

    void add(const std::string &name, const std::vector<double> &ms, const Found &found) {
        cases += (cases.empty() ? "" : ", ") + ("{\"case\": \"" + name + "\", \"ms\": [");
        for (size_t i = 0; i < ms.size(); i++) cases += (i ? ", " : "") + number(ms[i]);
        cases += "], \"found\": {";
        for (size_t i = 0; i < found.size(); i++)
            cases += (i ? ", \"" : "\"") + found[i].first + "\": " + number(found[i].second);
        cases += "}}";
    }

    void print() const { std::printf("{\"cases\": [%s]}\n", cases.c_str()); }

  private:
    static std::string number(double value) {
        char text[32];
        std::snprintf(text, sizeof text, "%.9g", value);
        return text;
    }

    std::string cases;
};

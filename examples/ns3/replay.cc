// SPDX-License-Identifier: GPL-2.0-only
//
// Replays a trace of `umbracast network --trace ns3` in ns-3 and checks that every loss comes out as it was written. The Python wheel
// of ns-3 has all that it needs:
//
//     pip install --no-deps --target wheel ns3==3.44.post0
//     g++ -std=c++20 -Iwheel/ns3/include replay.cc -o replay -Lwheel/ns3/lib64 -Wl,-rpath,$PWD/wheel/ns3/lib64 \
//         -lns3.44-core -lns3.44-network -lns3.44-mobility -lns3.44-propagation
//     umbracast network --trace ns3 --scenes 1 --carrier 28 --truth edges --out trace
//     ./replay trace/trace-200000.csv
//
// Prints how many losses were compared and the largest difference in dB; ends with 1 where it is more than a billionth.

#include "umbracast-loss.h"

#include "ns3/core-module.h"
#include "ns3/mobility-module.h"
#include "ns3/network-module.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>

using namespace ns3;

int main(int argc, char** argv)
{
    if (argc != 2)
    {
        std::cerr << "expected the name of a trace\n";
        return 2;
    }
    struct Row
    {
        double time;
        uint32_t accessPoint;
        uint32_t device;
        double loss;
    };
    std::vector<Row> rows;
    std::ifstream in(argv[1]);
    std::string line;
    std::getline(in, line);
    for (Row row; std::getline(in, line);)
    {
        if (std::sscanf(line.c_str(), "%lf,%u,%u,%lf", &row.time, &row.accessPoint, &row.device, &row.loss) == 4)
        {
            rows.push_back(row);
        }
    }
    uint32_t accessPointCount = 0;
    uint32_t deviceCount = 0;
    for (const Row& row : rows)
    {
        accessPointCount = std::max(accessPointCount, row.accessPoint + 1);
        deviceCount = std::max(deviceCount, row.device + 1);
    }
    NodeContainer accessPoints(accessPointCount);
    NodeContainer devices(deviceCount);
    MobilityHelper mobility;
    mobility.Install(accessPoints);
    mobility.Install(devices);
    auto model = CreateObject<UmbracastLossModel>();
    model->Read(argv[1], accessPoints, devices);

    // Each loss is asked for at its own time, by an event of the simulator.
    double worst = 0;
    uint32_t heard = 0;
    auto place = [](Ptr<Node> node) { return node->GetObject<MobilityModel>(); };
    for (const Row& row : rows)
    {
        Simulator::Schedule(Seconds(row.time), [&, row] {
            double power = model->CalcRxPower(0, place(accessPoints.Get(row.accessPoint)), place(devices.Get(row.device)));
            worst = std::max(worst, std::abs(-power - row.loss));
            heard++;
        });
    }
    Simulator::Run();
    Simulator::Destroy();
    std::printf("%u losses, largest difference %.9f dB\n", heard, worst);
    return heard == rows.size() && heard > 0 && worst < 1e-9 ? 0 : 1;
}

// SPDX-License-Identifier: GPL-2.0-only
//
// Replays in ns-3 what bodies cost radio links: the trace that `umbracast network --trace ns3` writes.
//
//     auto bodies = CreateObject<ns3::UmbracastLossModel>();
//     bodies->Read("trace.csv", accessPoints, devices);
//     auto free = CreateObject<ns3::FriisPropagationLossModel>();
//     free->SetNext(bodies);
//
// Written for ns-3.44. It derives from a class of ns-3 and is therefore under the licence of ns-3; the rest of Umbracast is not.

#ifndef UMBRACAST_LOSS_H
#define UMBRACAST_LOSS_H

#include "ns3/mobility-model.h"
#include "ns3/node-container.h"
#include "ns3/node.h"
#include "ns3/propagation-loss-model.h"
#include "ns3/simulator.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace ns3
{

/// Takes from every signal between an access point and a device what bodies cost it at the time. A loss holds until the next one.
class UmbracastLossModel : public PropagationLossModel
{
  public:
    static TypeId GetTypeId()
    {
        static TypeId tid = TypeId("ns3::UmbracastLossModel")
                                .SetParent<PropagationLossModel>()
                                .SetGroupName("Propagation")
                                .AddConstructor<UmbracastLossModel>();
        return tid;
    }

    /// Reads a trace: columns time_s, access_point, device, loss_db; later columns are not read. Numbers of access points and
    /// devices are places in the containers.
    void Read(const std::string& file, const NodeContainer& accessPoints, const NodeContainer& devices)
    {
        std::ifstream in(file);
        std::string line;
        if (!std::getline(in, line) || line.rfind("time_s,access_point,device,loss_db", 0) != 0)
        {
            throw std::runtime_error(file + ": expected a trace of umbracast");
        }
        while (std::getline(in, line))
        {
            std::replace(line.begin(), line.end(), ',', ' ');
            std::istringstream row(line);
            double time = 0;
            double loss = 0;
            uint32_t accessPoint = 0;
            uint32_t device = 0;
            if (!(row >> time >> accessPoint >> device >> loss) || accessPoint >= accessPoints.GetN() ||
                device >= devices.GetN())
            {
                throw std::runtime_error(file + ": expected a time, a known access point, a known device and a loss, found " + line);
            }
            Add(time, accessPoints.Get(accessPoint)->GetId(), devices.Get(device)->GetId(), loss);
        }
    }

    /// From `time` seconds on the link of two nodes loses `loss` dB. Times of a link must not fall.
    void Add(double time, uint32_t a, uint32_t b, double loss)
    {
        m_losses[std::minmax(a, b)].emplace_back(time, loss);
    }

  private:
    double DoCalcRxPower(double txPowerDbm, Ptr<MobilityModel> a, Ptr<MobilityModel> b) const override
    {
        auto link = m_losses.find(std::minmax(a->GetObject<Node>()->GetId(), b->GetObject<Node>()->GetId()));
        if (link == m_losses.end())
        {
            return txPowerDbm;
        }
        const auto& steps = link->second;
        auto later = [](double time, const std::pair<double, double>& step) { return time < step.first; };
        // Times are whole nanoseconds in ns-3: half of one keeps a step from being missed by a rounding.
        auto next = std::upper_bound(steps.begin(), steps.end(), Simulator::Now().GetSeconds() + 5e-10, later);
        return next == steps.begin() ? txPowerDbm : txPowerDbm - std::prev(next)->second;
    }

    int64_t DoAssignStreams(int64_t) override
    {
        return 0;
    }

    std::map<std::pair<uint32_t, uint32_t>, std::vector<std::pair<double, double>>> m_losses;
};

} // namespace ns3

#endif // UMBRACAST_LOSS_H

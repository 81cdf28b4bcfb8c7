#include "melt_rows.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <utility>

#include "base/random.h"

namespace trammel::test {
namespace {

constexpr double kLinePerFilament = 21.79;  // mm of line that 1 mm of filament lays (paper)

using Change = std::function<void(MeltWorld&)>;
using Add = std::function<void(const std::string&, const Change&)>;

void AddFlowModels(const Add& add) {
  for (const double exponent : {0.3, 0.5, 0.7}) {
    add(fmt::format("power {}", exponent),
        [=](MeltWorld& world) { world.physics.exponent = exponent; });
  }
  for (const auto& [exponent, yield] : {std::pair{0.5, 0.1}, {0.7, 0.3}}) {
    add(fmt::format("power {}, yield {:.0f} %", exponent, 100 * yield), [=](MeltWorld& world) {
      world.physics.exponent = exponent;
      world.physics.yield = yield;
    });
  }
  for (const auto& [structure, time_s] :
       {std::pair{0.5, 0.05}, {0.2, 0.15}, {0.5, 0.15}, {0.5, 0.3}}) {
    add(fmt::format("thixotropy {:.0f} %, {:.0f} ms", 100 * structure, 1e3 * time_s),
        [=](MeltWorld& world) {
          world.physics.structure = structure;
          world.physics.structure_time_s = time_s;
        });
  }
  for (const auto& [cooling, time_s] :
       {std::pair{-0.05, 0.1}, {0.05, 0.1}, {-0.15, 0.1}, {0.15, 0.1}, {-0.15, 0.3}, {0.15, 1.0}}) {
    add(fmt::format("cooling {:+.0f} %, {} s", 100 * cooling, time_s), [=](MeltWorld& world) {
      world.physics.cooling = cooling;
      world.physics.cooling_time_s = time_s;
    });
  }
  for (const double asymmetry : {0.05, 0.2}) {
    add(fmt::format("slower rise {:.0f} %", 100 * asymmetry),
        [=](MeltWorld& world) { world.physics.asymmetry = asymmetry; });
  }
}

void AddStorages(const Add& add) {
  add("two stages 20 %", [](MeltWorld& world) { world.physics.stages = {{0.2, 0.3, 0}}; });
  add("two stages 50 %", [](MeltWorld& world) { world.physics.stages = {{0.5, 1, 0}}; });
  add("three stages 60 %", [](MeltWorld& world) {
    world.physics.stages = {{0.3, 0.5, 0}, {0.3, 0.5, 0}};
  });
  for (const double order : {0.95, 0.8, 0.6}) {
    add(fmt::format("fractional {}", order),
        [=](MeltWorld& world) { AddCreep(world.physics, FractionalCreep(order)); });
  }
  for (const auto& [share, time_s] : {std::pair{0.1, 0.025}, {0.2, 0.04}, {0.3, 0.08}}) {
    add(fmt::format("creep {:.0f} %, {:.0f} ms", 100 * share, 1e3 * time_s), [=](MeltWorld& world) {
      AddCreep(world.physics, {{share, time_s}});
    });
  }
}

void AddDriveFaults(const Add& add) {
  for (const double friction : {0.05, 0.15}) {
    add(fmt::format("friction {:.0f} %", 100 * friction), [=](MeltWorld& world) {
      world.physics.stages = {{0.5, 0.1, friction}};
    });
  }
  for (const double backlash : {0.01, 0.02, 0.05}) {
    add(fmt::format("backlash {} mm", backlash),
        [=](MeltWorld& world) { world.physics.backlash_mm = backlash * kLinePerFilament; });
  }
  for (const double slip : {0.03, 0.08}) {
    add(fmt::format("slip {:.0f} %", 100 * slip),
        [=](MeltWorld& world) { world.physics.slip = slip; });
  }
}

void AddScatter(const Add& add) {
  for (const double drift : {-0.15, 0.15}) {
    add(fmt::format("viscosity drifts {:+.0f} %", 100 * drift),
        [=](MeltWorld& world) { world.viscosity_drift = drift; });
  }
  for (const double swell : {0.03, 0.1}) {
    add(fmt::format("swell {:.0f} %", 100 * swell), [=](MeltWorld& world) { world.swell = swell; });
  }
  for (const double scatter_s : {0.0015, 0.003}) {
    add(fmt::format("lag scatter t3 {} ms", 1e3 * scatter_s), [=](MeltWorld& world) {
      world.lag_scatter_s = scatter_s;
      world.lag_tails = true;
    });
  }
  for (const double length_mm : {0.5, 5.0}) {
    add(fmt::format("flow noise over {} mm", length_mm),
        [=](MeltWorld& world) { world.flow_noise_length_mm = length_mm; });
  }
  add("reading noise ~ area", [](MeltWorld& world) { world.reading = MeltNoise::kWithTheArea; });
  add("reading noise t3", [](MeltWorld& world) { world.reading = MeltNoise::kHeavyTails; });
}

struct Mechanism {
  std::string name;
  std::function<void(MeltWorld&, Random&)> draw;
};

std::vector<Mechanism> Mechanisms() {
  const auto sign = [](Random& random) { return random.Uniform() < 0.5 ? -1.0 : 1.0; };
  return {
      {"power", [](MeltWorld& w, Random& r) { w.physics.exponent = r.Uniform(0.3, 0.9); }},
      {"yield", [](MeltWorld& w, Random& r) { w.physics.yield = r.Uniform(0.05, 0.3); }},
      {"stage",
       [](MeltWorld& w, Random& r) {
         const double share = r.Uniform(0.1, 0.5);
         w.physics.stages.insert(w.physics.stages.begin(), {share, r.Uniform(0.2, 1), 0});
       }},
      {"fractional",
       [](MeltWorld& w, Random& r) { AddCreep(w.physics, FractionalCreep(r.Uniform(0.6, 0.95))); }},
      {"creep",
       [](MeltWorld& w, Random& r) {
         const double share = r.Uniform(0.1, 0.3);
         AddCreep(w.physics, {{share, r.Uniform(0.025, 0.08)}});
       }},
      {"thixotropy",
       [](MeltWorld& w, Random& r) {
         w.physics.structure = r.Uniform(0.2, 0.5);
         w.physics.structure_time_s = r.Uniform(0.05, 0.3);
       }},
      {"friction",
       [](MeltWorld& w, Random& r) {
         w.physics.stages.push_back({r.Uniform(0.2, 0.4), 0.1, r.Uniform(0.03, 0.15)});
       }},
      {"backlash",
       [](MeltWorld& w, Random& r) {
         w.physics.backlash_mm = kLinePerFilament * r.Uniform(0.01, 0.05);
       }},
      {"slip", [](MeltWorld& w, Random& r) { w.physics.slip = r.Uniform(0.02, 0.08); }},
      {"cooling",
       [sign](MeltWorld& w, Random& r) {
         w.physics.cooling = sign(r) * r.Uniform(0.05, 0.15);
         w.physics.cooling_time_s = 0.1 * std::pow(10, r.Uniform());
       }},
      {"drift",
       [sign](MeltWorld& w, Random& r) { w.viscosity_drift = sign(r) * r.Uniform(0.05, 0.15); }},
      {"swell", [](MeltWorld& w, Random& r) { w.swell = r.Uniform(0.03, 0.1); }},
      {"slower rise", [](MeltWorld& w, Random& r) { w.physics.asymmetry = r.Uniform(0.05, 0.2); }},
      {"lag tails", [](MeltWorld& w, Random&) { w.lag_tails = true; }},
      {"flow noise",
       [](MeltWorld& w, Random& r) { w.flow_noise_length_mm = 0.5 * std::pow(10, r.Uniform()); }},
      {"reading tails", [](MeltWorld& w, Random&) { w.reading = MeltNoise::kHeavyTails; }},
  };
}

// A seed for each printer, so that its mechanisms stay its own whatever the study's seeds are.
void AddAnyonesPrinters(const Add& add) {
  constexpr int kPrinters = 10, kMechanisms = 3;
  constexpr std::uint64_t kFirstSeed = 7000;
  for (int printer = 0; printer < kPrinters; ++printer) {
    Random random(kFirstSeed + static_cast<std::uint64_t>(printer));
    std::vector<Mechanism> left = Mechanisms();
    std::vector<std::pair<Mechanism, Random>> drawn;
    std::string name = fmt::format("{}:", printer + 1);
    for (int i = 0; i < kMechanisms; ++i) {
      const auto at = static_cast<std::ptrdiff_t>(random.Below(left.size()));
      name += (i == 0 ? " " : ", ") + left[static_cast<std::size_t>(at)].name;
      drawn.emplace_back(left[static_cast<std::size_t>(at)],
                         random.Fork(static_cast<std::uint64_t>(i)));
      left.erase(left.begin() + at);
    }
    add(name, [drawn](MeltWorld& world) {
      for (auto [mechanism, its_random] : drawn) mechanism.draw(world, its_random);
    });
  }
}

}  // namespace

std::vector<MeltRow> MeltRows(const MeltWorld& usual) {
  std::vector<MeltRow> rows;
  const Add add = [&](const std::string& name, const Change& change) {
    rows.push_back({name, usual});
    change(rows.back().world);
  };
  add("linear", [](MeltWorld&) {});
  AddFlowModels(add);
  AddStorages(add);
  AddDriveFaults(add);
  AddScatter(add);
  AddAnyonesPrinters(add);
  return rows;
}

}  // namespace trammel::test

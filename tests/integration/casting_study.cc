// Compares the fit of a CAD mesh with the best placement of the exact surface, over castings drawn
// anew. Prints the tables that docs/howto/part-alignment.md quotes.
//
// TRAMMEL_STUDY_SEEDS: castings of a row, 20 without it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <string>

#include "alignment_study.h"
#include "casting_world.h"

namespace trammel {
namespace {

using Eigen::Vector3d;
using part_alignment::FitPart;
using part_alignment::PartFit;

std::uint64_t Castings() { return test::WorldsOfStudy(20); }
std::uint64_t FirstSeed() { return test::FirstSeedOfStudy(); }

const Vector3d kHalf_mm(400, 250, 150);
constexpr double kWanted_mm = 3;

struct Row {
  int good = 0;
  double shift_mm = 0;
  double turn_rad = 0;
  double facet_mm = 0;
  double min_mm = 1e9;
};

Row Repeat(const sim::CastingTraits& traits, int steps) {
  Row row;
  for (std::uint64_t seed = FirstSeed(); seed < FirstSeed() + Castings(); ++seed) {
    CastingWorld world = MakeCastingWorld(kHalf_mm, traits, seed);
    world.input.surfaces = {MeshSurface(sim::FreeformFacets(world.part, steps), kWanted_mm)};
    const auto fit = FitPart(world.input, world.options);
    EXPECT_TRUE(fit) << (fit ? "" : fit.error().message);
    if (!fit) continue;
    if (fit->verdict != Verdict::kGood) {
      fmt::print("seed {}: {}: {}\n", seed, ToString(fit->verdict), fit->reason);
      continue;
    }
    ++row.good;
    const PlacementError error = ErrorOf(world, *fit);
    row.shift_mm = std::max(row.shift_mm, error.shift_mm);
    row.turn_rad = std::max(row.turn_rad, error.turn_rad);
    row.facet_mm = std::max(row.facet_mm, fit->facet_error_mm);
    row.min_mm = std::min(row.min_mm, LeastExactStock_mm(world, *fit));
  }
  return row;
}

TEST(CastingStudy, ComesAsNearTheBestPlacementAsItsTrianglesAllow) {
  fmt::print(
      "\n| triangles | good | farthest from the best: um | urad | facet error stated, um | least "
      "exact stock of 0.5 mm |\n|---|---|---|---|---|---|\n");
  for (const int steps : {50, 91, 289}) {
    const Row row = Repeat({}, steps);
    fmt::print("| {} | {} of {} | {:.2f} | {:.2f} | {:.1f} | {:.6f} |\n", 12 * steps * steps,
               row.good, Castings(), 1e3 * row.shift_mm, 1e6 * row.turn_rad, 1e3 * row.facet_mm,
               row.min_mm);
    std::fflush(stdout);
    EXPECT_EQ(row.good, static_cast<int>(Castings()));
    EXPECT_GE(row.min_mm, 0.5 - 1e-6);
    EXPECT_LE(row.shift_mm, 4 * row.facet_mm);
  }
}

TEST(CastingStudy, FindsOneSideOfAPartAndFewPoints) {
  fmt::print("\n| points | good | um | urad |\n|---|---|---|---|\n");
  for (const auto& [points, from_z] :
       {std::pair{10'000, 0.0}, std::pair{1000, 0.3}, std::pair{100, -1.0}, std::pair{30, -1.0}}) {
    sim::CastingTraits traits;
    traits.points = points;
    traits.seen_from_z = from_z;
    traits.dents = points >= 1000 ? 3 : 1;
    const Row row = Repeat(traits, 50);
    fmt::print("| {}, z above {} of the unit sphere | {} of {} | {:.1f} | {:.1f} |\n", points,
               from_z, row.good, Castings(), 1e3 * row.shift_mm, 1e6 * row.turn_rad);
    std::fflush(stdout);
  }
}

TEST(CastingStudy, GivesNoPlacementThatIsWrong) {
  fmt::print("\n| what is wrong | refused or left open |\n|---|---|\n");
  struct Fault {
    const char* name;
    std::function<void(CastingWorld&, std::uint64_t)> make;
  };
  sim::CastingTraits traits;
  traits.points = 2000;
  const auto mesh_of = [](const sim::Freeform& part, double scale, int steps) {
    auto facets = sim::FreeformFacets(part, steps);
    for (auto& facet : facets) {
      for (Vector3d& corner : facet) corner *= scale;
    }
    return MeshSurface(facets, kWanted_mm);
  };
  constexpr int kSteps = 40;
  const std::vector<Fault> faults = {
      {"inches taken for mm",
       [&](CastingWorld& w, std::uint64_t) {
         w.input.surfaces = {mesh_of(w.part, 1 / 25.4, kSteps)};
       }},
      {"mm taken for inches",
       [&](CastingWorld& w, std::uint64_t) { w.input.surfaces = {mesh_of(w.part, 25.4, kSteps)}; }},
      {"metres taken for mm",
       [&](CastingWorld& w, std::uint64_t) { w.input.surfaces = {mesh_of(w.part, 1e-3, kSteps)}; }},
      {"another part of the same size",
       [&](CastingWorld& w, std::uint64_t seed) {
         w.input.surfaces = {mesh_of(sim::DrawFreeform(kHalf_mm, seed + 50'000), 1, kSteps)};
       }},
      {"the mirrored part",
       [&](CastingWorld& w, std::uint64_t) {
         auto facets = sim::FreeformFacets(w.part, kSteps);
         for (auto& facet : facets) {
           for (Vector3d& corner : facet) corner.x() = -corner.x();
         }
         w.input.surfaces = {MeshSurface(facets, kWanted_mm)};
       }},
      {"raw part 2 % too small", [&](CastingWorld& w, std::uint64_t) {
         w.input.surfaces = {mesh_of(w.part, 1.02, kSteps)};
       }}};
  for (const Fault& fault : faults) {
    int caught = 0;
    for (std::uint64_t seed = FirstSeed(); seed < FirstSeed() + Castings(); ++seed) {
      CastingWorld world = MakeCastingWorld(kHalf_mm, traits, seed);
      fault.make(world, seed);
      const auto fit = FitPart(world.input, world.options);
      if (fit && fit->verdict != Verdict::kGood) {
        ++caught;
        if (seed == FirstSeed()) fmt::print("{}\n", fit->reason);
      } else if (fit) {
        fmt::print("seed {}: uneven {:.3f} least {:.3f}\n", seed, fit->uneven_mm, fit->min_mm);
      }
    }
    fmt::print("| {} | {} of {} |\n", fault.name, caught, Castings());
    std::fflush(stdout);
    EXPECT_EQ(caught, static_cast<int>(Castings())) << fault.name;
  }
}

}  // namespace
}  // namespace trammel

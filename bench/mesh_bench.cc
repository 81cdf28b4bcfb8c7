// A CAD mesh of a million triangles: reading it, distances from it, and a fit of 10,000 points.
// "peak_MB" is the most memory of the process so far: ask for one benchmark at a time
// (--benchmark_filter=...).
#include <benchmark/benchmark.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "base/random.h"
#include "part_alignment/files/stl_file.h"
#include "part_alignment/part_fit/part_fit.h"
#include "sim/casting/casting.h"
#include "sim/casting/freeform_mesh.h"

namespace {

using namespace trammel;

constexpr std::uint64_t kSeed = 1;
const Eigen::Vector3d kHalf_mm(400, 250, 150);

double PeakMegabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

/// Written by a child, so that the making of triangles is not in this process's memory.
class StlOnDisk {
 public:
  explicit StlOnDisk(int steps, bool text = false)
      : path_(std::filesystem::temp_directory_path() / ("mesh_bench_" + std::to_string(getpid()))) {
    const pid_t child = fork();
    if (child == 0) {
      const auto facets = sim::FreeformFacets(sim::DrawFreeform(kHalf_mm, kSeed), steps);
      std::ofstream file(path_, std::ios::binary);
      file << (text ? sim::AsciiStl(facets) : sim::BinaryStl(facets));
      file.close();
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
  }
  ~StlOnDisk() { std::filesystem::remove(path_); }
  StlOnDisk(const StlOnDisk&) = delete;
  StlOnDisk& operator=(const StlOnDisk&) = delete;

  [[nodiscard]] files::MeshFile Read() const {
    return files::ReadMeshFile(path_, files::LengthUnitOf("mm"), false).value();
  }

 private:
  std::filesystem::path path_;
};

/// 12 · steps² triangles: welded, checked, with its tree.
void ReadMesh(benchmark::State& state) {
  const StlOnDisk stl(static_cast<int>(state.range(0)), state.range(1) != 0);
  for (auto _ : state) benchmark::DoNotOptimize(stl.Read());
  state.counters["peak_MB"] = PeakMegabytes();
}
BENCHMARK(ReadMesh)
    ->ArgNames({"steps", "ascii"})
    ->Args({91, 0})
    ->Args({289, 0})
    ->Args({91, 1})  // a million as text is more than is read
    ->Args({645, 0})
    ->Unit(benchmark::kMillisecond);

void Distance(benchmark::State& state) {
  const files::MeshFile file = StlOnDisk(static_cast<int>(state.range(0))).Read();
  const sim::Casting casting = sim::DrawCasting(sim::DrawFreeform(kHalf_mm, kSeed), {}, kSeed);
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(file.mesh->At(casting.ideal_mm[i]));
    i = (i + 1) % casting.ideal_mm.size();
  }
}
BENCHMARK(Distance)->ArgName("steps")->Arg(91)->Arg(289)->Unit(benchmark::kMicrosecond);

part_alignment::PartFitInput InputOf(const files::MeshFile& file, double missing_mm) {
  sim::CastingTraits traits;
  if (missing_mm > 0) traits.missing_mm = missing_mm;
  const sim::Casting casting = sim::DrawCasting(sim::DrawFreeform(kHalf_mm, kSeed), traits, kSeed);
  part_alignment::PartFitInput input;
  for (std::size_t i = 0; i < casting.measured_mm.size(); ++i) {
    input.points.push_back({std::to_string(i), casting.measured_mm[i], 0.05, "cad"});
  }
  part_alignment::IdealSurface surface;
  surface.id = "cad";
  surface.kind = part_alignment::SurfaceKind::kMesh;
  surface.stock_allowance_mm = 3;
  surface.mesh = file.mesh;
  input.surfaces = {surface};
  return input;
}

/// From nothing: the search among all rotations, the optimum and its covariance, or the proof that
/// there is none. With reading at most 5 s and 500 MB.
void ReadAndFit(benchmark::State& state) {
  const StlOnDisk stl(static_cast<int>(state.range(0)));
  const double missing_mm = static_cast<double>(state.range(1));
  part_alignment::PartFitOptions options;
  options.least_stock_allowance_mm = 0.4;
  for (auto _ : state) {
    const auto fit = part_alignment::FitPart(InputOf(stl.Read(), missing_mm), options);
    if (fit->verdict != (missing_mm > 0 ? Verdict::kRefused : Verdict::kGood)) {
      state.SkipWithError(fit->reason.c_str());
    }
  }
  state.counters["peak_MB"] = PeakMegabytes();
}
BENCHMARK(ReadAndFit)
    ->ArgNames({"steps", "missing_mm"})
    ->Args({289, 0})
    ->Args({289, 1})
    ->Unit(benchmark::kMillisecond);

}  // namespace

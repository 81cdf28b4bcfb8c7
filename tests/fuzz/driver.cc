// Runs a fuzz target. With libFuzzer (TRAMMEL_FUZZ) the environment names it, TRAMMEL_FUZZ_TARGET;
// else the tests replay each corpus:
//   fuzz_targets TARGET PLACE…   files, or folders of them
#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "fuzz.h"

namespace {

namespace fs = std::filesystem;

using Target = trammel::fuzz::RegisteredTarget::Run;

std::map<std::string, Target>& Targets() {
  static std::map<std::string, Target> targets;
  return targets;
}

#ifndef TRAMMEL_FUZZ

std::vector<fs::path> FilesOf(const fs::path& place) {
  if (!fs::is_directory(place)) return {place};
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(place)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string BytesOf(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  trammel::fuzz::Require(file.good(), "an input of the corpus can be read");
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void Run(Target target, std::string_view bytes) {
  // A copy of exactly this size: a sanitizer sees each byte that is read beyond it.
  const std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
  target(copy.data(), copy.size());
}

/// Each input, and what is left of it when a connection or a copy breaks off.
int Replay(Target target, const fs::path& place) {
  constexpr std::size_t kCuts = 16;
  int inputs = 0;
  for (const fs::path& path : FilesOf(place)) {
    std::printf("%s\n", path.c_str());
    std::fflush(stdout);  // names the input where the next lines end the process
    const std::string bytes = BytesOf(path);
    Run(target, bytes);
    for (std::size_t cut = 0; cut < kCuts; ++cut) {
      Run(target, std::string_view(bytes).substr(0, bytes.size() * cut / kCuts));
    }
    ++inputs;
  }
  return inputs;
}

#endif

}  // namespace

trammel::fuzz::RegisteredTarget::RegisteredTarget(const char* name, Run run) {
  Targets().emplace(name, run);
}

#ifdef TRAMMEL_FUZZ
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Target target = [] {
    const char* name = std::getenv("TRAMMEL_FUZZ_TARGET");
    const auto found = Targets().find(name == nullptr ? "" : name);
    trammel::fuzz::Require(found != Targets().end(), "TRAMMEL_FUZZ_TARGET names a target");
    return found->second;
  }();
  return target(data, size);
}
#else
int main(int count, char** arguments) {
  try {
    const auto target = Targets().find(count > 1 ? arguments[1] : "");
    if (target == Targets().end()) {
      std::fprintf(stderr, "usage: fuzz_targets TARGET PLACE..., TARGET one of\n");
      for (const auto& [name, run] : Targets()) std::fprintf(stderr, "  %s\n", name.c_str());
      return 1;
    }
    int inputs = 0;
    for (int i = 2; i < count; ++i) inputs += Replay(target->second, arguments[i]);
    std::printf("%d inputs\n", inputs);
    return inputs > 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "escaped: %s\n", error.what());
    return 1;
  }
}
#endif

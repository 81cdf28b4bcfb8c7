// Runs a fuzz target. With libFuzzer (TRAMMEL_FUZZ) the environment names it, TRAMMEL_FUZZ_TARGET;
// else the tests replay each corpus:
//   fuzz_targets TARGET PLACE…   files, or folders of them
#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

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
  const std::vector<char> copy(bytes.begin(), bytes.end());
  target({copy.data(), copy.size()});
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

/// Memory limit of the process that reads PDFs: larger requests fail.
extern "C" const char* __asan_default_options() {
  return "allocator_may_return_null=1:max_allocation_size_mb=256";
}

namespace trammel::fuzz {

RegisteredTarget::RegisteredTarget(const char* name, Run run) { Targets().emplace(name, run); }

MemoryFile::MemoryFile(const std::string& name) {
  std::error_code none;
  const fs::path memory = "/dev/shm";
  const bool there = fs::is_directory(memory, none);
  std::string folder =
      ((there ? memory : fs::temp_directory_path()) / "trammel-fuzz-XXXXXX").string();
  Require(mkdtemp(folder.data()) != nullptr, "there is a folder for temporary files");
  path_ = fs::path(folder) / name;
}

MemoryFile::~MemoryFile() {
  std::error_code ignored;
  fs::remove_all(path_.parent_path(), ignored);
}

void MemoryFile::Write(std::string_view bytes) const {
  constexpr mode_t kRights = 0600;
  const int file = open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kRights);
  Require(file >= 0, "the temporary file can be opened");
  while (!bytes.empty()) {
    const ssize_t written = write(file, bytes.data(), bytes.size());
    Require(written > 0, "the temporary file can be written");
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  close(file);
}

}  // namespace trammel::fuzz

#ifdef TRAMMEL_FUZZ
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Target target = [] {
    const char* name = std::getenv("TRAMMEL_FUZZ_TARGET");
    const auto found = Targets().find(name == nullptr ? "" : name);
    trammel::fuzz::Require(found != Targets().end(), "TRAMMEL_FUZZ_TARGET names a target");
    return found->second;
  }();
  target({reinterpret_cast<const char*>(data), size});
  return 0;
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

// Runs work in a process that may take only so much more memory and computing.
#pragma once

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

namespace trammel::test {

struct LittleMemory {
  unsigned long long bytes = 300ULL << 20U;  ///< address space, in addition to this process's own
  unsigned seconds = 20;                     ///< CPU time
};

/// Returns the result of `work`; "died" if the process did not survive.
inline std::string WithLittleMemory(const std::function<std::string()>& work,
                                    const LittleMemory& limits = {}) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) return "no pipe";
  const pid_t process = fork();
  if (process == 0) {
    close(ends[0]);
    unsigned long long pages = 0;
    std::FILE* const own = std::fopen("/proc/self/statm", "r");
    if (own == nullptr || std::fscanf(own, "%llu", &pages) != 1) _exit(2);
    std::fclose(own);
#ifndef TRAMMEL_SANITIZED
    const rlim_t most = pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + limits.bytes;
    const rlimit addresses{most, most};
    setrlimit(RLIMIT_AS, &addresses);
#endif
    const rlimit computing{limits.seconds, limits.seconds};
    setrlimit(RLIMIT_CPU, &computing);
    std::string said = "said: ";
    try {
      said += work();
    } catch (...) {
      said += "an exception";
    }
    const bool sent = write(ends[1], said.data(), said.size()) == static_cast<ssize_t>(said.size());
    _exit(sent ? 0 : 2);
  }
  close(ends[1]);
  std::string heard;
  std::array<char, 4096> buffer{};
  for (ssize_t count = 0; (count = read(ends[0], buffer.data(), buffer.size())) > 0;) {
    heard.append(buffer.data(), static_cast<std::size_t>(count));
  }
  close(ends[0]);
  int status = 0;
  waitpid(process, &status, 0);
  return heard.empty() ? "died" : heard;
}

}  // namespace trammel::test

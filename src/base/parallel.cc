#include "base/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace trammel {

void ParallelFor(int count, const std::function<void(int)>& work, int max_threads) {
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto run = [&] {
    for (int i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::lock_guard lock(failure_mutex);
        if (!failure) failure = std::current_exception();
        next = count;
      }
    }
  };
  const int processors = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const int helpers = std::min({count, processors, max_threads}) - 1;
  {
    std::vector<std::jthread> threads;
    try {
      for (int i = 0; i < helpers; ++i) threads.emplace_back(run);
    } catch (const std::system_error&) {  // none to be had: the others do it
    }
    run();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace trammel

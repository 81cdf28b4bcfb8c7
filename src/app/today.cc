#include "app/today.h"

#include <fmt/format.h>

#include <ctime>

namespace trammel::app {

std::string Today() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  constexpr int kFirstYear = 1900;
  return fmt::format("{:04}-{:02}-{:02}", kFirstYear + local.tm_year, local.tm_mon + 1,
                     local.tm_mday);
}

}  // namespace trammel::app

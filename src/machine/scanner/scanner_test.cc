// Drivers that crash, hang and lie, loaded by SANE's own loader.
#include "machine/scanner/scanner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "machine/net/host_clock.h"
#include "support/sanitized.h"
#include "support/temporary_folder.h"

namespace trammel::machine {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Scanner : public testing::Test {
 protected:
  Scanner() {
    test::WriteWhole(folder_.path() / "dll.conf", "faulty\n");
    setenv("SANE_CONFIG_DIR", folder_.path().c_str(), 1);
    setenv("LD_LIBRARY_PATH", TRAMMEL_FAULTY_SANE, 1);
  }
  ~Scanner() override {
    unsetenv("SANE_CONFIG_DIR");
    unsetenv("LD_LIBRARY_PATH");
    // Whatever happened, no process is left: neither running nor as a zombie.
    EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
    EXPECT_EQ(errno, ECHILD);
  }

  [[nodiscard]] Result<Page> Scan(const std::string& fault, const PageReadOptions& limits = {},
                                  const std::stop_token& stop = {}) const {
    ScanRequest request;
    request.device = "faulty:" + fault;
    request.silence_s = 0.5;
    request.rest_s = 0.3;
    return ScanPage(request, limits, {}, stop);
  }
  [[nodiscard]] Error ErrorOf(const std::string& fault, const PageReadOptions& limits = {}) const {
    const auto page = Scan(fault, limits);
    EXPECT_FALSE(page) << fault;
    return page ? Error{} : page.error();
  }

  test::TemporaryFolder folder_;
};

TEST_F(Scanner, PutsTornLinesTogether) {
  const auto page = Scan("works");
  ASSERT_TRUE(page) << page.error().message;
  EXPECT_EQ(page->width, 100);
  EXPECT_EQ(page->height, 50);
  EXPECT_EQ(page->samples, std::vector<std::uint8_t>(5000, 200));
  EXPECT_EQ(page->dpi_x, 600);
}

TEST_F(Scanner, ADriverThatCrashesIsAnErrorThatNamesSignalAndDevice) {
  if (test::kSanitized) GTEST_SKIP() << "the sanitizer takes the crash for its own";
  for (const char* fault : {"crashes-when-opened", "crashes"}) {
    const Error error = ErrorOf(fault);
    EXPECT_EQ(error.kind, ErrorKind::kMachine);
    EXPECT_THAT(error.message, AllOf(HasSubstr(std::string("faulty:") + fault),
                                     HasSubstr("crashed (signal 11, Segmentation fault)")));
  }
  EXPECT_THAT(ErrorOf("leaves-when-opened").message, HasSubstr("exit code 0"));
}

TEST_F(Scanner, ADriverThatHangsIsAnErrorThatNamesTheSilence) {
  for (const char* fault : {"hangs-when-opened", "hangs"}) {
    const Error error = ErrorOf(fault);
    EXPECT_EQ(error.kind, ErrorKind::kMachine);
    EXPECT_THAT(error.message, AllOf(HasSubstr(std::string("faulty:") + fault),
                                     HasSubstr("said nothing for 0.5 s")));
  }
}

TEST_F(Scanner, WhatADriverDoesAfterThePageDoesNotTakeItAway) {
  for (const char* fault : {"hangs-when-closed", "crashes-when-closed"}) {
    const auto page = Scan(fault);
    ASSERT_TRUE(page) << page.error().message;
    EXPECT_EQ(page->height, 50);
  }
}

TEST_F(Scanner, ADriverThatContradictsItselfIsRefused) {
  EXPECT_THAT(ErrorOf("has-narrow-lines").message, HasSubstr("99 bytes a line where 100"));
  EXPECT_THAT(ErrorOf("has-no-width").message, HasSubstr("-1 x 50 px"));
  EXPECT_THAT(ErrorOf("has-odd-bits").message, HasSubstr("12 bits"));
  EXPECT_THAT(ErrorOf("ends-early").message, HasSubstr("after 25 of 50 lines"));
  EXPECT_THAT(ErrorOf("repeats-red").message, HasSubstr("no whole page"));
  PageReadOptions limits;
  limits.most_pixels = 1'000'000;
  EXPECT_THAT(ErrorOf("is-endless", limits).message, HasSubstr("1 megapixels"));
}

TEST_F(Scanner, AStopEndsADriverThatDoesNotListenToIt) {
  std::stop_source stop;
  std::jthread user([&stop] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    stop.request_stop();
  });
  const double began_s = HostNow();
  const auto page = Scan("hangs", {}, stop.get_token());
  ASSERT_FALSE(page);
  EXPECT_EQ(page.error().kind, ErrorKind::kInterrupted);
  // 0.1 s until the stop and 0.3 s of patience; the rest is for a machine with other work.
  constexpr double kPrompt_s = 5;
  EXPECT_LT(HostNow() - began_s, kPrompt_s);
}

TEST_F(Scanner, NoScannerIsSaidPlainly) {
  const auto scanners = ListScanners();
  ASSERT_TRUE(scanners) << scanners.error().message;
  EXPECT_TRUE(scanners->empty());
  ScanRequest request;
  const auto page = ScanPage(request, {}, {}, {});
  ASSERT_FALSE(page);
  EXPECT_THAT(page.error().message, HasSubstr("no scanner was found"));
}

}  // namespace
}  // namespace trammel::machine

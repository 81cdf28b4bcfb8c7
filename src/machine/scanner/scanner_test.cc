// Drivers that crash, hang and lie: a script in scanimage's place.
#include "machine/scanner/scanner.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cerrno>
#include <chrono>
#include <thread>

#include "machine/net/host_clock.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::machine {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kList = R"(
All options specific to device `fake:0':
  Scan Mode:
    --mode Lineart|Gray|24bit Color [Lineart]
        Selects the scan mode (e.g., lineart, monochrome, or color).
    --resolution 75|300|600dpi [75]
    --three-pass[=(yes|no)] [inactive]
    --source Flatbed|Automatic Document Feeder [Flatbed]
    --gamma <float> [1]
  Geometry:
    -l 0..200mm (in steps of 1) [0]
    -t 0..200mm (in steps of 1) [0]
    -x 0..200mm (in steps of 1) [80]
    -y 0..287.5mm [100]
)";

TEST(ScannerOptions, AreReadAsScanimageListsThem) {
  ScannerOptions options;
  std::string_view text = kList;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    options.Add(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  ASSERT_NE(options.Find("mode"), nullptr);
  EXPECT_THAT(options.Find("mode")->choices, ElementsAre("Lineart", "Gray", "24bit Color"));
  const ScannerOption* resolution = options.Find("resolution");
  ASSERT_NE(resolution, nullptr);
  EXPECT_THAT(resolution->choices, ElementsAre("75", "300", "600"));
  EXPECT_TRUE(resolution->Takes(600.0));
  EXPECT_FALSE(resolution->Takes(1200.0));
  ASSERT_NE(options.Find("y"), nullptr);
  EXPECT_EQ(options.Find("y")->range, std::pair(0.0, 287.5));
  EXPECT_EQ(options.Find("y")->Values(), "0 to 287.5");
  EXPECT_THAT(options.Find("three-pass")->choices, ElementsAre("yes", "no"));
  EXPECT_EQ(options.FindActive("three-pass"), nullptr);
  EXPECT_TRUE(options.Find("gamma")->Takes(std::string_view("anything")));
  EXPECT_EQ(options.Find("Selects"), nullptr);
}

class Scanner : public testing::Test {
 protected:
  ~Scanner() override {
    // Whatever happened, no process is left: neither running nor as a zombie.
    EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
    EXPECT_EQ(errno, ECHILD);
  }

  /// A scanimage that has one scanner and does `scan` when it is to scan into $out.
  [[nodiscard]] ScanRequest Request(const std::string& scan) const {
    const auto program = folder_.path() / "scanimage";
    test::WriteWhole(folder_.path() / "list", kList);
    test::WriteWhole(program, fmt::format(R"(#!/bin/sh
for word; do
  case $word in
    -f) printf 'fake:0\tAcme\tGlass\tflatbed scanner\n'; exit 0;;
    -A) exec cat {}/list;;
    --output-file=*) out=${{word#*=}};;
  esac
done
printf '%s\n' "$*" > {}/words
{}
)",
                                          folder_.path().string(), folder_.path().string(), scan));
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    ScanRequest request;
    request.program = program;
    request.silence_s = 0.5;
    request.rest_s = 0.3;
    return request;
  }
  [[nodiscard]] Result<Page> Scan(const std::string& scan, const PageReadOptions& limits = {},
                                  const std::stop_token& stop = {}) const {
    return ScanPage(Request(scan), folder_.path() / "page.png", limits, {}, stop);
  }
  [[nodiscard]] Error ErrorOf(const std::string& scan, const PageReadOptions& limits = {}) const {
    const auto page = Scan(scan, limits);
    EXPECT_FALSE(page) << scan;
    EXPECT_FALSE(std::filesystem::exists(folder_.path() / "page.png")) << scan;
    return page ? Error{} : page.error();
  }

  test::TemporaryFolder folder_;
};

TEST_F(Scanner, IsAskedForTheWholeGlassInGreyInItsOwnWords) {
  (void)ErrorOf("exit 1");
  EXPECT_THAT(test::ReadWhole(folder_.path() / "words"),
              AllOf(HasSubstr("--device-name=fake:0 --format=tiff"),
                    HasSubstr("--source=Flatbed --mode=Gray --resolution=600"),
                    HasSubstr("-l 0 -t 0 -x 200 -y 287.5")));
}

TEST_F(Scanner, ADriverThatCrashesIsAnErrorThatNamesSignalAndDevice) {
  const Error error = ErrorOf("kill -SEGV $$");
  EXPECT_EQ(error.kind, ErrorKind::kMachine);
  EXPECT_THAT(error.message, AllOf(HasSubstr("scanner fake:0"),
                                   HasSubstr("crashed (signal 11, Segmentation fault)")));
}

TEST_F(Scanner, AFaultThatSaneNamesComesWithWhatToDo) {
  const Error error = ErrorOf(
      "echo 'scanimage: sane_read: Error during device I/O' >&2\n"
      "echo 'scanimage: received signal 13' >&2\nexit 9");
  EXPECT_EQ(error.kind, ErrorKind::kMachine);
  EXPECT_THAT(error.message, HasSubstr("look at cable, network and power"));
}

TEST_F(Scanner, APageThatGrowsBeyondTheLimitOrIsNoneIsRefused) {
  PageReadOptions limits;
  limits.most_pixels = 50'000'000;  // the glass has 32 at 600 dpi
  EXPECT_THAT(ErrorOf("exec truncate -s 1000000000 $out", limits).message,
              HasSubstr("larger than the limit"));
  EXPECT_THAT(ErrorOf("echo nothing > $out").message, HasSubstr("cannot be read back"));
}

TEST_F(Scanner, AStopEndsADriverThatDoesNotListenToIt) {
  std::stop_source stop;
  std::jthread user([&stop] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    stop.request_stop();
  });
  const double began_s = HostNow();
  EXPECT_THAT(Scan("trap '' TERM; while :; do printf .; sleep 0.01; done", {}, stop.get_token()),
              FailsWith(ErrorKind::kInterrupted));
  // 0.2 s until the stop and 0.3 s of patience; the rest is for a machine with other work.
  constexpr double kPrompt_s = 5;
  EXPECT_LT(HostNow() - began_s, kPrompt_s);
}

}  // namespace
}  // namespace trammel::machine

#include "machine/net/command_process.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>

#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::machine {
namespace {

using ::testing::ElementsAre;

struct Output {
  std::vector<std::string> output;
  std::vector<std::string> error;
  CommandEnd end;
};

std::vector<std::string> Shell(const std::string& script) { return {"/bin/sh", "-c", script}; }

Output Follow(const std::vector<std::string>& words) {
  Output heard;
  const auto process = Must(CommandProcess::Start(words));
  heard.end = (process)->Follow([&heard](OutputStream stream, std::string_view line) {
    (stream == OutputStream::kOutput ? heard.output : heard.error).emplace_back(line);
  });
  return heard;
}

void WaitForFile(const std::filesystem::path& file) {
  constexpr int kMax = 2000;
  for (int i = 0; i < kMax && !std::filesystem::exists(file); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_TRUE(std::filesystem::exists(file)) << file;
}

TEST(CommandProcess, ALineWithoutAnEndIsCutAndTheNextOneHeard) {
  const Output heard = Follow(Shell("head -c 100000 /dev/zero | tr '\\0' x; echo; echo next"));
  ASSERT_EQ(heard.output.size(), 2U);
  EXPECT_EQ(heard.output[0].size(), 4096U);
  EXPECT_EQ(heard.output[1], "next");
}

TEST(CommandProcess, InheritsNoOpenFile) {
  const int fd = open("/dev/null", O_RDONLY);  // no O_CLOEXEC, like files of some libraries
  ASSERT_GE(fd, 3);
  const Output heard = Follow(Shell("test -e /proc/$$/fd/" + std::to_string(fd) + " && echo open"));
  EXPECT_THAT(heard.output, ElementsAre());
  close(fd);
}

TEST(CommandProcess, EndsAsItLikesWhenAsked) {
  const test::TemporaryFolder folder;
  const auto ready = folder.path() / "ready";
  auto process =
      Must(CommandProcess::Start(Shell("trap 'echo safe; exit 130' TERM; : > " + ready.string() +
                                       "; while :; do sleep 0.01; done")));
  WaitForFile(ready);
  process->AskToEnd();
  std::string last;
  const CommandEnd end =
      process->Follow([&last](OutputStream, std::string_view line) { last = std::string(line); });
  EXPECT_EQ(last, "safe");
  EXPECT_EQ(end.exit_code, 130);
  process->AskToEnd();  // nobody any more
}

TEST(CommandProcess, IsAskedToEndAndKilledAfterSilenceOrAStop) {
  for (const bool stopped : {false, true}) {
    std::stop_source stop;
    auto process =
        Must(CommandProcess::Start(Shell("trap '' TERM; echo deaf; while :; do sleep 0.01; done")));
    const CommandEnd end = process->Follow(
        [&](OutputStream, std::string_view) {
          if (stopped) stop.request_stop();
        },
        {stop.get_token(), 0.5, 0.1});
    EXPECT_EQ(end.cause, stopped ? CommandEnd::Cause::kStop : CommandEnd::Cause::kSilence);
    EXPECT_EQ(end.signal, SIGKILL);
  }
  // A display of progress is no silence.
  auto busy = Must(
      CommandProcess::Start(Shell("for i in 1 2 3 4 5; do printf \"$i\\r\"; sleep 0.2; done")));
  int lines = 0;
  const CommandEnd end = busy->Follow([&lines](OutputStream, std::string_view) { ++lines; },
                                      {.stop = {}, .silence_s = 0.6, .rest_s = 1});
  EXPECT_EQ(end.cause, CommandEnd::Cause::kItself);
  EXPECT_EQ(lines, 5);
}

// The reader of its words is not kept by what it has left running.
TEST(CommandProcess, EndsWithTheProcessThoughAGrandchildHoldsItsPipes) {
  const Output heard = Follow(Shell("sleep 30 & echo $!"));
  ASSERT_EQ(heard.output.size(), 1U);
  kill(std::stoi(heard.output[0]), SIGKILL);
}

TEST(CommandProcess, IsAskedToEndWhenItsParentIsKilled) {
  const test::TemporaryFolder folder;
  const auto ready = folder.path() / "ready";
  const auto safe = folder.path() / "safe";
  const pid_t parent = fork();
  if (parent == 0) {
    const auto process =
        CommandProcess::Start(Shell("trap ': > " + safe.string() + "; exit' TERM; : > " +
                                    ready.string() + "; while :; do sleep 0.01; done"));
    if (process) (void)(*process)->Follow([](OutputStream, std::string_view) {});
    _exit(0);
  }
  WaitForFile(ready);
  kill(parent, SIGKILL);
  waitpid(parent, nullptr, 0);
  WaitForFile(safe);
}

}  // namespace
}  // namespace trammel::machine

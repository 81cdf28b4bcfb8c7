#include "machine/net/dialogue_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>

#include "support/matchers.h"

namespace trammel::machine {
namespace {

using ::testing::HasSubstr;

std::unique_ptr<DialogueProcess> Shell(const std::string& script) {
  return Must(DialogueProcess::Start({"/bin/sh", "-c", script}));
}

TEST(DialogueProcess, AnswersLineForLineAndEndsWithItsInput) {
  pid_t pid = -1;
  {
    const auto cat = Shell("exec cat");
    pid = cat->process();
    EXPECT_EQ(cat->Ask("one", 10, {}), "one");
    EXPECT_EQ(cat->Ask(std::string(50'000, 'x'), 10, {}), std::string(50'000, 'x'));
  }
  EXPECT_NE(kill(pid, 0), 0);
}

TEST(DialogueProcess, SaysThatAProgramCannotBeStartedOrHasEnded) {
  EXPECT_THAT(DialogueProcess::Start({"/nowhere/program"}),
              FailsWith("/nowhere/program cannot be started: No such file"));
  const auto gone = Shell("exit 3");
  EXPECT_EQ(gone->ReadLine(10, {}).error().message, "it has ended");
  EXPECT_EQ(gone->Ask("one", 10, {}).error().message, "it has ended");
}

TEST(DialogueProcess, ALineWithoutEndASilenceAndAStopEndTheWait) {
  const auto endless = Shell("while :; do printf xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx; done");
  EXPECT_THAT(endless->ReadLine(60, {}).error().message, HasSubstr("says more than"));
  const auto silent = Shell("exec cat");
  EXPECT_THAT(silent->ReadLine(0.05, {}).error().message, HasSubstr("does not answer within"));
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(silent->ReadLine(60, source.get_token()).error().kind, ErrorKind::kInterrupted);
}

TEST(DialogueProcess, IsInAGroupOfItsOwnWithoutTheFilesOfThisProcess) {
  const auto list = Shell("exec ls /proc/self/fd");
  // The fourth is that folder.
  for (const char* file : {"0", "1", "2", "3"}) EXPECT_EQ(list->ReadLine(10, {}), file);
  EXPECT_FALSE(list->ReadLine(10, {}));
  const auto cat = Shell("exec cat");
  EXPECT_EQ(getpgid(cat->process()), cat->process());
}

}  // namespace
}  // namespace trammel::machine

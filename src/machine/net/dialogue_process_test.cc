#include "machine/net/dialogue_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>

namespace trammel::machine {
namespace {

using ::testing::HasSubstr;

std::unique_ptr<DialogueProcess> Shell(const std::string& script) {
  auto process = DialogueProcess::Start({"/bin/sh", "-c", script});
  EXPECT_TRUE(process) << process.error().message;
  return process ? std::move(*process) : nullptr;
}

TEST(DialogueProcess, AnswersLineForLineAndEndsWithItsInput) {
  pid_t pid = -1;
  {
    const auto cat = Shell("exec cat");
    ASSERT_TRUE(cat);
    pid = cat->process();
    EXPECT_EQ(cat->Ask("one", 10, {}), "one");
    EXPECT_EQ(cat->Ask(std::string(50'000, 'x'), 10, {}), std::string(50'000, 'x'));
  }
  EXPECT_NE(kill(pid, 0), 0);
}

TEST(DialogueProcess, SaysThatAProgramCannotBeStartedOrHasEnded) {
  const auto none = DialogueProcess::Start({"/nowhere/program"});
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("/nowhere/program cannot be started: No such file"));
  const auto gone = Shell("exit 3");
  ASSERT_TRUE(gone);
  EXPECT_EQ(gone->ReadLine(10, {}).error().message, "it has ended");
  EXPECT_EQ(gone->Ask("one", 10, {}).error().message, "it has ended");
}

TEST(DialogueProcess, ALineWithoutEndASilenceAndAStopEndTheWait) {
  const auto endless = Shell("while :; do printf xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx; done");
  ASSERT_TRUE(endless);
  EXPECT_THAT(endless->ReadLine(60, {}).error().message, HasSubstr("says more than"));
  const auto silent = Shell("exec cat");
  ASSERT_TRUE(silent);
  EXPECT_THAT(silent->ReadLine(0.05, {}).error().message, HasSubstr("does not answer within"));
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(silent->ReadLine(60, source.get_token()).error().kind, ErrorKind::kInterrupted);
}

TEST(DialogueProcess, IsInAGroupOfItsOwnWithoutTheFilesOfThisProcess) {
  const auto list = Shell("exec ls /proc/self/fd");
  ASSERT_TRUE(list);
  // The fourth is that folder.
  for (const char* file : {"0", "1", "2", "3"}) EXPECT_EQ(list->ReadLine(10, {}), file);
  EXPECT_FALSE(list->ReadLine(10, {}));
  const auto cat = Shell("exec cat");
  ASSERT_TRUE(cat);
  EXPECT_EQ(getpgid(cat->process()), cat->process());
}

}  // namespace
}  // namespace trammel::machine

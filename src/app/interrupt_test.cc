#include "app/interrupt.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <semaphore>
#include <thread>

#include "app/commands.h"
#include "base/bug_note.h"
#include "base/check.h"
namespace trammel::app {
namespace {

constexpr unsigned kPatience_s = 60;

/// Runs in a process of its own: its exit code, or -signal where one ended it.
int InAProcess(const std::function<int()>& work) {
  const pid_t child = fork();
  if (child == 0) _exit(work());
  int status = 0;
  for (unsigned i = 0; waitpid(child, &status, WNOHANG) == 0; ++i) {
    if (i > 100 * kPatience_s) kill(child, SIGKILL);
    usleep(10'000);
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

bool Caught(int number) {
  // The first two cannot be caught, the others end nothing.
  for (const int other :
       {SIGKILL, SIGSTOP, SIGTSTP, SIGTTIN, SIGTTOU, SIGCHLD, SIGCONT, SIGURG, SIGWINCH}) {
    if (number == other) return false;
  }
#ifdef TRAMMEL_SANITIZED
  for (const int fault : {SIGILL, SIGBUS, SIGFPE, SIGSEGV, SIGSYS}) {  // held back by none
    if (number == fault) return false;
  }
#endif
  // 32 and 33 are the C library's own.
  return number < 32 || number >= SIGRTMIN;
}

TEST(Interrupt, AsksToStopForEverySignalThatWouldEndTheProcess) {
  for (int number = 1; number <= SIGRTMAX; ++number) {
    if (!Caught(number)) continue;
    EXPECT_EQ(InAProcess([number] {
                GuardConsole();
                const Interrupt interrupt;
                std::binary_semaphore asked(0);
                const std::stop_callback stop(interrupt.token(), [&] { asked.release(); });
                kill(getpid(), number);
                // Those that would come of writing are noticed where it is written.
                if (number != SIGPIPE && number != SIGXFSZ) asked.acquire();
                return 0;
              }),
              0)
        << "signal " << number;
  }
}

TEST(Interrupt, OutlivesEverySignalThatFollowsTheFirst) {
  EXPECT_EQ(InAProcess([] {
              GuardConsole();
              const Interrupt interrupt;
              std::binary_semaphore asked(0);
              const std::stop_callback stop(interrupt.token(), [&] { asked.release(); });
              kill(getpid(), SIGINT);
              asked.acquire();
              for (const int number : {SIGINT, SIGHUP, SIGQUIT, SIGTERM, SIGINT}) {
                kill(getpid(), number);
              }
              return 0;
            }),
            0);
}

TEST(Interrupt, LeavesHangUpsToWhoAskedToOutliveThem) {
  EXPECT_EQ(InAProcess([] {
              std::signal(SIGHUP, SIG_IGN);  // nohup
              GuardConsole();
              const Interrupt interrupt;
              std::binary_semaphore asked(0);
              const std::stop_callback stop(interrupt.token(), [&] { asked.release(); });
              kill(getpid(), SIGHUP);
              const sigset_t ending = EndingSignals();
              if (sigismember(&ending, SIGHUP) != 0) return 1;
              kill(getpid(), SIGTERM);
              asked.acquire();
              return 0;
            }),
            0);
}

TEST(EndOfServing, ComesWithEverySignalThatWouldEndTheProcess) {
  for (const int number : {SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1, SIGALRM, SIGRTMIN}) {
    EXPECT_EQ(InAProcess([number] {
                GuardConsole();
                const EndOfServing end;
                kill(getpid(), number);
                end.Wait({});
                return 0;
              }),
              0)
        << "signal " << number;
  }
}

// First: what is noted in a process stays noted.
TEST(ExitCode, ACommandWithoutABugEndsWithItsOwnCode) {
  EXPECT_EQ(ExitCodeOf([] { return static_cast<int>(kExitNotTrusted); }), kExitNotTrusted);
}

TEST(ExitCode, ABugHasOneOfItsOwnOnWhateverThreadItWas) {
  EXPECT_EQ(ExitCodeOf([]() -> int { throw Bug("here"); }), 70);
  EXPECT_EQ(ExitCodeOf([] {
              std::thread([] { (void)NoteBug([] { throw Bug("there"); }); }).join();
              return static_cast<int>(kExitGood);
            }),
            70);
}

}  // namespace
}  // namespace trammel::app

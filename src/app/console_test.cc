#include "app/console.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <string>

#include "support/temporary_folder.h"

namespace trammel::app {
namespace {

// Exit codes of the children.
constexpr int kAsItShould = 0, kThrew = 10, kOtherwise = 11;

/// Runs in a process of its own, whose streams may be spoilt; -signal where one ended it.
int InAProcess(const std::function<int()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGPIPE, SIG_DFL);
    try {
      _exit(work());
    } catch (const std::exception&) {
      _exit(kThrew);
    }
  }
  int status = 0;
  if (waitpid(child, &status, 0) != child) return kOtherwise;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

void SayMuch() {
  for (int i = 0; i < 1000; ++i) {
    fmt::print("line {:04} of many that are said\n", i);
    fmt::print(stderr, "and a word aside\n");
    std::fflush(stdout);
  }
}

TEST(GuardedConsole, OutlivesAReaderThatHasGone) {
  EXPECT_EQ(InAProcess([] {
              int ends[2];
              if (pipe(ends) != 0) return kOtherwise;
              dup2(ends[1], STDOUT_FILENO);
              dup2(ends[1], STDERR_FILENO);
              close(ends[0]);
              GuardConsole();
              SayMuch();
              return FinishConsole() ? kAsItShould : kOtherwise;
            }),
            kAsItShould);
}

TEST(GuardedConsole, SaysInTheEndThatADiskIsFull) {
  EXPECT_EQ(InAProcess([] {
              dup2(open("/dev/full", O_WRONLY), STDOUT_FILENO);
              GuardConsole();
              SayMuch();
              const auto said = FinishConsole();
              if (said) return kOtherwise;
              return said.error().message.find("No space left") != std::string::npos ? kAsItShould
                                                                                     : kOtherwise;
            }),
            kAsItShould);
}

TEST(GuardedConsole, MakesALimitOnFilesAnErrorOfWriting) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() / "out";
  EXPECT_EQ(InAProcess([&] {
              dup2(open(path.c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
              GuardConsole();
              const rlimit limit{1000, 1000};
              setrlimit(RLIMIT_FSIZE, &limit);
              SayMuch();
              return FinishConsole() ? kOtherwise : kAsItShould;
            }),
            kAsItShould);
}

TEST(GuardedConsole, WaitsForNobodyWhileAMachineMoves) {
  EXPECT_EQ(InAProcess([] {
              alarm(60);  // where it waits after all
              int ends[2];
              if (pipe(ends) != 0) return kOtherwise;
              fcntl(ends[1], F_SETPIPE_SZ, 4096);  // fills at once: nobody reads yet
              dup2(ends[1], STDOUT_FILENO);
              close(ends[1]);
              GuardConsole();
              {
                const ConsoleDoesNotWait moving;
                SayMuch();
              }
              const pid_t reader = fork();
              if (reader == 0) {
                close(STDOUT_FILENO);
                std::string all;
                char piece[1000];
                for (ssize_t n = 0; (n = read(ends[0], piece, sizeof piece)) > 0;) {
                  all.append(piece, static_cast<std::size_t>(n));
                }
                const std::size_t line =
                    fmt::format("line {:04} of many that are said\n", 0).size();
                _exit(all.size() == 1000 * line && all.ends_with("0999 of many that are said\n")
                          ? kAsItShould
                          : kOtherwise);
              }
              if (!FinishConsole()) return kOtherwise;
              close(STDOUT_FILENO);
              int status = -1;
              waitpid(reader, &status, 0);
              return WIFEXITED(status) ? WEXITSTATUS(status) : kOtherwise;
            }),
            kAsItShould);
}

TEST(GuardedConsole, LastWordsWaitForNoReaderOnceTheEndWasAskedFor) {
  EXPECT_EQ(InAProcess([] {
              alarm(60);  // where it waits after all
              int ends[2];
              if (pipe(ends) != 0) return kOtherwise;  // both ends stay open, and nobody reads
              fcntl(ends[1], F_SETPIPE_SZ, 4096);
              dup2(ends[1], STDOUT_FILENO);
              GuardConsole();
              WaitForNoReaderAnyMore();
              SayMuch();
              (void)FinishConsole();
              return kAsItShould;
            }),
            kAsItShould);
}

TEST(GuardedConsole, LastWordsWaitForNoTerminalThatNobodyReads) {
  for (const std::size_t room : {1, 100, 511}) {
    EXPECT_EQ(InAProcess([room] {
                alarm(60);  // where it waits after all
                const int reader = posix_openpt(O_RDWR | O_NOCTTY);
                if (reader < 0 || grantpt(reader) != 0 || unlockpt(reader) != 0) return kOtherwise;
                const int terminal = open(ptsname(reader), O_RDWR | O_NOCTTY | O_NONBLOCK);
                if (terminal < 0) return kOtherwise;
                while (write(terminal, "x", 1) == 1) continue;  // full
                std::string read_again(room, ' ');
                if (read(reader, read_again.data(), room) <= 0) return kOtherwise;
                fcntl(terminal, F_SETFL, O_RDWR);  // as a shell leaves it
                dup2(terminal, STDOUT_FILENO);
                GuardConsole();
                WaitForNoReaderAnyMore();
                SayMuch();
                (void)FinishConsole();
                const bool shared_as_it_was = (fcntl(STDOUT_FILENO, F_GETFL) & O_NONBLOCK) == 0;
                return shared_as_it_was ? kAsItShould : kOtherwise;
              }),
              kAsItShould)
        << room;
  }
}

TEST(GuardedConsole, LetsNoFileTakeThePlaceOfAClosedStream) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() / "results";
  EXPECT_EQ(InAProcess([&] {
              close(STDIN_FILENO);
              close(STDOUT_FILENO);
              close(STDERR_FILENO);
              GuardConsole();
              const int file = open(path.c_str(), O_WRONLY | O_CREAT, 0600);
              SayMuch();
              return FinishConsole() && file > STDERR_FILENO ? kAsItShould : kOtherwise;
            }),
            kAsItShould);
  EXPECT_EQ(test::ReadWhole(path), "");
}

TEST(GuardedConsole, ShowsWhatATerminalWouldObey) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() / "out";
  EXPECT_EQ(InAProcess([&] {
              dup2(open(path.c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
              GuardConsole();
              fmt::print("{}\n", "camera \x1b]0;owned\a says \xC3");
              for (const char byte : std::string("°C\n")) {  // in pieces
                fmt::print("{}", byte);
                std::fflush(stdout);
              }
              return FinishConsole() ? kAsItShould : kOtherwise;
            }),
            kAsItShould);
  EXPECT_EQ(test::ReadWhole(path), "camera \\u001b]0;owned\\u0007 says \xEF\xBF\xBD\n°C\n");
}

}  // namespace
}  // namespace trammel::app

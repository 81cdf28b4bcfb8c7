#include "part_alignment/procedure/align_picture.h"

#include <utility>

#include "machine/net/host_clock.h"

namespace trammel::procedure {
namespace {

constexpr double kPictureLimit_s = 10;

}  // namespace

StillPictures::StillPictures(machine::FrameSource& source, double settle_s)
    : source_(source), settle_s_(settle_s) {
  if (source.live()) reader_.emplace(source, kPictureLimit_s);
}

Result<machine::CapturedFrame> StillPictures::Take(const std::stop_token& stop) {
  if (!reader_) {
    auto frame = TRY(source_.Next(kPictureLimit_s, stop));
    if (!frame) {
      return Fail("there is no further picture: one is wanted for each view of the plan",
                  ErrorKind::kMeasurement);
    }
    return std::move(*frame);
  }
  const double settled_s = machine::HostNow() + settle_s_;
  const double end_s = settled_s + kPictureLimit_s;
  while (machine::HostNow() < end_s) {
    auto frame = reader_->NextFrame(end_s - machine::HostNow(), stop);
    if (!frame) return frame;
    const bool told = OnOurClock(*frame);
    // A camera that else says when it took its pictures may have been late with this one.
    if (!told && times_are_told_) continue;
    times_are_told_ = told;
    const double taken_s = told ? frame->captured->time_s : frame->arrival_s;
    if (taken_s >= settled_s) return frame;
  }
  return Fail("no picture came after the machine had settled", ErrorKind::kMachine);
}

}  // namespace trammel::procedure

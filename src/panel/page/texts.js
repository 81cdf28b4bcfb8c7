// Every sentence that a user reads, except those of the service.

const phases = {
  starting: "Starting",
  checking: "Checking",
  homing: "Homing",
  heating: "Heating",
  cooling: "Cooling",
  uploading: "Uploading",
  printing: "Printing",
  scanning: "Scanning",
  analysing: "Analysing",
  restoring: "Restoring the printer",
  stopping: "Stopping",
  ended: "Ended",
};

const ends = { done: "Done", failed: "Failed", stopped: "Stopped", unknown: "Nobody knows how it ended" };

const jobs = {
  pressure_advance: "Scan by laser",
  photo_pattern: "Print of the pattern",
  photo: "Measurement of a photo",
  offset_sheet: "Print of the sheet for tool offsets",
  offset_scan: "Measurement of tool offsets",
  apply: "Setting the value",
};

const instruments = {
  pressure_advance: "Pressure advance",
  tool_offset: "Tool offset",
  tap: "Tap",
  part_alignment: "Part alignment",
};

const verdicts = { good: "Good", cannot_tell: "Cannot tell", refused: "Refused" };

export const texts = {
  name: "trammel",
  connecting: "Connecting",
  lost: "Connection lost: trying again",
  back: "Connected again",
  notKnown: "not known",
  phase: (phase) => phases[phase] ?? phase,
  end: (end) => ends[end] ?? end,
  job: (job) => jobs[job] ?? job,
  instrument: (instrument) => instruments[instrument] ?? instrument,
  verdict: (verdict) => verdicts[verdict] ?? verdict,
  percent: (share) => `${Math.round(100 * share)} %`,
  left: (seconds) =>
    seconds < 90 ? `about ${Math.max(1, Math.round(seconds))} s left` : `about ${Math.round(seconds / 60)} min left`,
  megabytes: (bytes, of) => `${(bytes / 1e6).toFixed(1)} of ${(of / 1e6).toFixed(1)} MB`,

  printer: "Printer",
  inForce: "Pressure advance now on",
  printerNotReady: (readiness, message) =>
    `The printer is not ready (${readiness})${message ? `: ${message}` : ". Switch it on, or restart Klipper."}`,

  waits: "An answer waits",
  waitsFor: (filament) => `An answer waits for ${filament}`,
  use: "Use it",
  useOn: (printer) => `Use it on ${printer}`,
  used: (printer, place) => `Set on ${printer} until Klipper restarts.${place ? ` To keep it: ${place}.` : ""}`,
  using: "Setting it",
  drop: "Drop it",
  dropped: "Dropped",
  inPhase: (job, phase) => `${job}: ${phase.toLowerCase()}`,
  lastRun: (job, end) => `${job}: ${end.toLowerCase()}`,
  nowPhotograph: "Let the bed cool, leave the print on it, and photograph it.",

  stop: "Stop",
  stopping: "Stopping: the printer is restored first",
  emergencyStop: "Emergency stop",
  emergencyQuestion: "Stop everything at once?",
  emergencyDetail: "Heaters and motors go off, and the head stays where it is. Klipper needs a restart afterwards.",
  emergencyYes: "Stop everything",
  emergencyDone: "Emergency stop sent",
  cancel: "Cancel",

  photograph: "Photograph the print",
  photographAnother: "Take another photo",
  whatPrinted: "What did you print?",
  patterns: [
    ["trammel", "trammel's pattern"],
    ["orca-line", "OrcaSlicer: PA Line"],
    ["orca-pattern", "OrcaSlicer or Ellis: PA Pattern"],
    ["marlin-lines", "Marlin: K-factor lines"],
  ],
  photoAdvice: "All lines in the picture, from straight above. Light from one side, no flash.",
  more: "G-code and filament (optional)",
  gcode: "G-code of the print: the answer gets surer",
  remove: "Remove",
  filament: "Filament: the value is stored for it",
  choosePhoto: "Take or choose the photo",
  sending: "Sending the photo",
  measuring: "Measuring: some seconds",
  notSent: "The photo did not arrive. Send it again.",
  refusedUpload: (status) =>
    ({
      413: "The file is too large. Send the photo as the phone took it, without the G-code.",
      415: "The file is no photo that can be read. Send a JPEG, PNG, WebP or HEIC.",
    })[status] ?? `The service did not take the photo (${status}). Send it again.`,
  sendAgain: "Send it again",
  measured: (words) => `Measured: ${words}`,
  notMeasured: (words) => `No value: ${words}`,

  answer: "Pressure advance",
  barNow: "now",
  pictureOfAnswer: "Graph of the answer: how far each printed line was off",
  pictureOfPhoto: "The photo, with an outline around what was read",
  showPhoto: "The photo as it was read",
  report: "Report with every line",
  copyFor: "Copy for",
  copy: "Copy",
  copied: "Copied",
  copyByHand: "The text is selected: copy it by hand",
  keep: (place) => `To keep it: ${place}`,
  needReady: (printer) => `${printer} is not ready: copy the value, or try later.`,
  tries: "Photos of this visit",
  show: "Show",

  printPattern: "Print the pattern",
  printQuestion: "Is the bed empty?",
  printDetail: "The printer heats, homes and prints the pattern for the photo. Then it switches its heaters off.",
  printYes: "It is empty: print",
  scan: "Scan by laser",
  scanDetail: "The printer heats, prints lines and measures them by its laser and camera. No photo is needed.",
  scanYes: "It is empty: print and scan",
  cannot: (job, reason) => `${job} is not possible now: ${reason}`,
  filamentName: "Filament (optional)",
  material: "Material",
  materialOfSettings: "as in the settings",
  materials: ["pla", "petg", "abs", "asa", "tpu", "pc", "pa"],

  setup: "Set-up of the printer",
  setupWhy: "The printer lacks trammel's macros: buttons on its own screen, and the limits by which Klipper itself switches heaters off.",
  setUp: "Set the printer up",
  setUpDetail: "The files above are changed through Moonraker, and Klipper restarts. You can take it back here.",
  undoSetUp: "Take the set-up back",
  undoDetail: "The files become as they were before, and Klipper restarts.",
  restartYes: "Change and restart",
  restarting: "Klipper restarts: up to a minute",
  setUpDone: "Done",
  missing: (count) => `printer.cfg lacks ${count === 1 ? "a section" : `${count} sections`} that trammel can use`,

  history: "History",
  noHistory: "No results yet.",
  columns: ["When", "What", "Result", "Set"],
  set: "✓ set",
  openPanel: "Open the whole panel",
  version: (version) => `trammel ${version}`,
};

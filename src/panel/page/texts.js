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
  undo: "Setting the value back",
};

// Says what the owner does after a job that is done.
const nexts = {
  photo_pattern: "Let the bed cool, leave the print on it, and photograph it.",
  offset_sheet: "Scan the sheet, or photograph it. Then measure it under tool offsets.",
};

const instruments = {
  pressure_advance: "Pressure advance",
  tool_offset: "Tool offset",
  tap: "Tap",
  part_alignment: "Part alignment",
};

const pictures = {
  arrows: "Arrows: how far each tool prints from the first",
  "answer.png": "Graph of the answer: how far each printed line was off",
  "photo.png": "The photo, with an outline around what was read",
  "response.png": "Response of the lines to each value",
  "profiles.png": "Profiles along the lines",
  "height_maps.png": "Heights of the lines, as the laser saw them",
};

const steps = { applied: "✓ set", before: "was set", begun: "not known if set", undoing: "not known if set", undone: "taken back" };

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
  used: (printer, place) =>
    `Set on ${printer} until Klipper restarts.${place ? ` To keep it: ${place}. A slicer that sets pressure advance overwrites it.` : ""}`,
  keptBy: "pressure_advance under [extruder] in printer.cfg",
  why: "Why",
  using: "Setting it",
  drop: "Drop it",
  dropped: "Dropped",
  inPhase: (job, phase) => `${job}: ${phase.toLowerCase()}`,
  lastRun: (job, end) => `${job}: ${end.toLowerCase()}`,
  next: (job) => nexts[job],

  stop: "Stop",
  stopping: "Stopping: the printer is restored first",
  emergencyStop: "Emergency stop",
  emergencyQuestion: "Stop everything at once?",
  emergencyDetail: "Heaters and motors go off, and the head stays where it is. Klipper needs a restart afterwards.",
  emergencyYes: "Stop everything",
  emergencyDone: "Emergency stop sent",
  cancel: "Cancel",

  due: (what, why) => `${what}: ${why}`,
  live: "The camera of the run, live",

  photograph: "Photograph the print",
  photographAnother: "Take another photo",
  whatPrinted: "What did you print?",
  patterns: [
    ["trammel", "trammel's pattern"],
    ["orca-line", "OrcaSlicer: PA Line"],
    ["orca-pattern", "OrcaSlicer or Ellis: PA Pattern"],
    ["marlin-lines", "Marlin: K-factor lines"],
  ],
  intro: "Print the pattern below, or your slicer's pressure advance test. Photograph it when it is cold. Use the value.",
  photoAdvice: "All lines in the picture, from straight above. Light from one side, no flash.",
  more: "G-code and filament (optional)",
  gcode: "G-code of the print: speeds and values need no guess",
  remove: "Remove",
  filament: "Filament: the value is stored for it",
  choosePhoto: "Take or choose the photo",
  sending: "Sending the photo",
  measuring: "Measuring: some seconds",
  notSent: "The file did not arrive. Send it again.",
  refusedUpload: (status) =>
    ({
      413: "The file is too large: 64 MB at most.",
      415: "The file cannot be read. Send a photo as JPEG, PNG, WebP or HEIC, a scan as PDF, PNG, JPEG or TIFF.",
    })[status] ?? `The service did not take the file (${status}). Send it again.`,
  sendAgain: "Send it again",
  measured: (words) => `Measured: ${words}`,
  notMeasured: (words) => `No value: ${words}`,

  answer: "Pressure advance",
  barNow: "now",
  picture: (name, instrument) =>
    name === "answer.png" && instrument === "tool_offset" ? pictures.arrows : (pictures[name] ?? name),
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
  bedQuestion: "Is the bed empty?",
  printDetail: "The printer heats, homes and prints the pattern for the photo. Then it switches its heaters off.",
  printYes: "It is empty: print",
  scan: "Scan by laser",
  scanDetail: "The printer heats, prints lines and measures them by its laser and camera. No photo is needed.",
  scanYes: "It is empty: print and scan",
  cannot: (job, reason) => `${job} is not possible now: ${reason}`,
  fields: { filament: "Filament (optional)", material: "Material", tools: "Tools, such as 0,1 (empty: all)" },
  materialOfSettings: "as in the settings",
  materials: ["pla", "petg", "abs", "asa", "tpu", "pc", "pa"],

  toolOffsets: "Tool offsets by a sheet of paper",
  printSheet: "Print the sheet",
  paperQuestion: "Is paper taped flat, and is the bed cold?",
  sheetDetail: "The paper lies where the settings put it. The printer homes, heats its nozzles and prints on the paper.",
  sheetYes: "Taped and cold: print",
  measureSheet: "Measure the scan",
  measureSheetDetail: "The sheet as a PDF, PNG, JPEG or TIFF of a scanner, or as a photo. Nothing moves or heats.",
  sendingSheet: "Sending the scan",

  taps: "Taps by the load cell",
  notWatching: "New taps are not read: the service was started without --answer-taps.",
  noTaps: "No taps yet. Each tap is shown here as it comes.",
  contactHeight: "Contact height",
  place: (x, y) => `at X ${x.toFixed(1)}, Y ${y.toFixed(1)} mm`,
  firmwareZ: (z) => `the printer's own z: ${z.toFixed(4)} mm`,
  forceCurve: "Force of the tap against the nozzle's height",
  force: "force, g",
  height: "height of the nozzle, mm",
  contact: "contact",

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

  survey: "Survey of a part",
  surveyAdvice:
    "Coded targets on the part, scale bars beside it, pictures from all sides with fixed zoom and focus: each is answered at once.",
  addPicture: "Add pictures",
  newSurvey: "Begin another one",
  sendingPicture: (number, of) => `Sending picture ${number} of ${of}`,
  fewPictures: (least, targets) =>
    `In fewer than ${least} pictures: ${targets.slice(0, 20).join(", ")}${targets.length > 20 ? ` and ${targets.length - 20} more` : ""}`,
  surveyFile: (name) =>
    ({ "report.html": "Report", "surveyed.csv": "Points for align fit", "surveyed.json": "Targets for align solve" })[name] ?? name,
  pictures: (count) => `Pictures: ${count}`,
  targetsSeen: (count) => `${count} targets`,
  takeOut: "Take out",
  targets: (count) => `Targets: ${count}`,
  seenIn: (count) => (count === 1 ? "in 1 picture" : `in ${count} pictures`),
  within95: (half_mm) => `within ${half_mm.toFixed(3)} mm (95 %)`,
  notGiven: "not given",
  bars: (count) => `Scale bars: ${count}`,
  barsAdvice: "The codes at both ends, the calibrated length and its standard uncertainty. Three bars, so that a wrong one is found.",
  bar: (number) => `Bar ${number}`,
  barFields: { from: "From", to: "To", length_mm: "Length, mm", sigma_mm: "Uncertainty, mm" },
  saveBars: "Use these bars",

  history: "History",
  noHistory: "No results yet.",
  columns: ["When", "What", "Result", "State"],
  step: (step) => steps[step] ?? "",
  pinned: "pinned",
  showMore: "Show more",
  exportTable: "Export as a table (CSV)",
  whichInstrument: "Show",
  whichFilament: "Of filament",
  all: "all",
  chartOf: "Chart of",
  chart: (name, count) => `${name}: ${count} values over time, as in the table below`,
  chartLegend: "Lines: 95 % intervals. Filled: set on the printer. Touch a point to see its result.",
  answerName: (name) => {
    const tool = /^tool_(\d+)_d(x|y)$/.exec(name);
    const words = tool ? `Tool ${tool[1]} ${tool[2].toUpperCase()}` : name.replaceAll("_", " ");
    return words[0].toUpperCase() + words.slice(1);
  },
  nozzle: (diameter) => `${diameter} mm`,
  nozzleAt: (diameter, degrees) =>
    `nozzle ${[diameter && `${diameter} mm`, degrees && `${degrees} °C`].filter(Boolean).join(" at ")}`,
  bedAt: (degrees) => `bed ${degrees} °C`,
  spool: (number) => `spool ${number}`,
  measuredOn: (printer, ago) => [printer ? `Measured on ${printer}` : "Measured", ago].filter(Boolean).join(", "),
  filesGone: "The files of this result were deleted.",
  takeBack: "Take it back",
  takeBackQuestion: "Set the earlier value again?",
  takeBackDetail: (before) => (before == null ? "The printer gets back what this result replaced." : `The printer gets back ${before.toFixed(4)} s.`),
  copyTo: "Copy to a printer with this nozzle",
  copyOver: "Copy",
  note: "Note",
  saveNote: "Save the note",
  noteTooLong: "The note is too long: 500 bytes at most.",
  compareWith: "Compare with",
  chooseOne: "choose a result",
  pin: "Pin it",
  unpin: "Unpin it",
  delete: "Delete",
  deleteQuestion: "Delete this result?",
  deleteDetail: "Its pictures, its report and its note go, too. Nobody can bring them back.",
  deleted: "Deleted",
  openPanel: "Open the whole panel",
  version: (version) => version,
};

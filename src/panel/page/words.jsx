/** An answer of the service, "NAME = VALUE UNIT (INTERVAL)", with its value large. Other texts stay as they are. */
export function Words({ words }) {
  const parts = /^(?:\w+ = )?([-+]?[\d.]+ \S+) \((.*)\)$/.exec(words);
  if (!parts) return <p class="words">{words}</p>;
  return (
    <p class="words">
      <span class="value">{parts[1]}</span> <span class="interval">{parts[2]}</span>
    </p>
  );
}

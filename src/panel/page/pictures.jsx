import { texts } from "./texts.js";

const fileOf = (run, name) => `runs/${encodeURIComponent(run)}/${name}`;

/** The pictures of a run: one is shown, the others unfold. */
export function Pictures({ run, pictures, instrument, first = "answer.png" }) {
  return (
    <>
      {pictures.includes(first) && <img src={fileOf(run, first)} alt={texts.picture(first, instrument)} />}
      {pictures
        .filter((name) => name !== first)
        .map((name) => (
          <details key={name}>
            <summary>{texts.picture(name, instrument)}</summary>
            <img src={fileOf(run, name)} alt={texts.picture(name, instrument)} loading="lazy" />
          </details>
        ))}
    </>
  );
}

export function Report({ run, report }) {
  if (!report) return null;
  return (
    <p>
      <a class="touch" href={fileOf(run, report)} target="_blank" rel="noopener">
        {texts.report}
      </a>
    </p>
  );
}

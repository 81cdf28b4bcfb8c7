import { useEffect, useRef } from "preact/hooks";

/** A table's row with details that a touch unfolds. The first cell is a button, for keyboards and screen readers. */
export function Row({ open, toggle, cells, children }) {
  const [first, ...rest] = cells;
  const row = useRef();
  useEffect(() => {
    if (open) row.current.scrollIntoView({ block: "nearest" }); // it may have been chosen elsewhere on the page
  }, [open]);
  return (
    <>
      <tr ref={row} class="row" onClick={toggle}>
        <td>
          <button class="plain" aria-expanded={open}>
            {first}
          </button>
        </td>
        {rest.map((cell, i) => (
          <td key={i}>{cell}</td>
        ))}
      </tr>
      {open && (
        <tr class="unfolded">
          <td colspan={cells.length}>{children}</td>
        </tr>
      )}
    </>
  );
}

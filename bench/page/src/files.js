// Files out of the page, and into it.

/** Downloads a file of the bench: its address gives it once. */
export function save({ name, url }) {
  Object.assign(document.createElement('a'), { href: url, download: name }).click()
}

/** The text of a file that the user picks; data sheets may be in Latin-1. */
export async function fileText(file) {
  const bytes = await file.arrayBuffer()
  try {
    return new TextDecoder('utf-8', { fatal: true }).decode(bytes)
  } catch {
    return new TextDecoder('latin1').decode(bytes)
  }
}

// Downloads and uploads of files.

/** Downloads a file of the bench, whose address is valid only once. */
export function save({ name, url }) {
  Object.assign(document.createElement('a'), { href: url, download: name }).click()
}

/** The text of a file that the user has picked, in UTF-8 or Latin-1 as data sheets are. */
export async function fileText(file) {
  const bytes = await file.arrayBuffer()
  try {
    return new TextDecoder('utf-8', { fatal: true }).decode(bytes)
  } catch {
    return new TextDecoder('latin1').decode(bytes)
  }
}

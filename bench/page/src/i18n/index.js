// The texts of the page. Texts of the bench (faults, reasons, names of data sheets) are not translated.
import { signal } from '@preact/signals'
import { TEXTS } from './texts.js'

/** In the order of the texts for each key. */
export const LANGUAGES = ['en', 'de']
const KEY = 'language'

/**
 * The language in the address (`lexican bench --lang`), else the one chosen last, else that of the browser. A language
 * in the address is removed from it, and becomes the chosen one.
 */
export function firstLanguage({ location, localStorage, history, navigator } = globalThis) {
  const address = location && new URL(location.href)
  const asked = address?.searchParams.get('lang')
  if (asked) {
    address.searchParams.delete('lang')
    history.replaceState(null, '', address.href)
    if (LANGUAGES.includes(asked)) localStorage.setItem(KEY, asked)
  }
  const kept = localStorage?.getItem(KEY)
  if (LANGUAGES.includes(kept)) return kept
  const wanted = navigator?.languages ?? []
  return wanted.map((tag) => tag.slice(0, 2)).find((tag) => LANGUAGES.includes(tag)) ?? 'en'
}

export const language = signal(firstLanguage())

export function setLanguage(next) {
  language.value = next
  localStorage.setItem(KEY, next)
}

/** The text of `key`, with `{name}` replaced by `values.name`. */
export function t(key, values = {}) {
  const text = TEXTS[key]?.[LANGUAGES.indexOf(language.value)] ?? key
  return text.replace(/\{(\w+)\}/g, (_, name) => values[name] ?? '')
}

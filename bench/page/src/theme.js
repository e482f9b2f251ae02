// Light, dark, or as the system has it.
import { signal } from '@preact/signals'

export const THEMES = ['system', 'light', 'dark']
export const theme = signal(THEMES.includes(localStorage.getItem('theme')) ? localStorage.getItem('theme') : 'system')

export function nextTheme() {
  theme.value = THEMES[(THEMES.indexOf(theme.value) + 1) % THEMES.length]
  localStorage.setItem('theme', theme.value)
}

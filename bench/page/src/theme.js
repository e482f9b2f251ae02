// Light, dark, or the system's theme.
import { computed, signal } from '@preact/signals'

export const THEMES = ['system', 'light', 'dark']
export const theme = signal(THEMES.includes(localStorage.getItem('theme')) ? localStorage.getItem('theme') : 'system')

const system = matchMedia('(prefers-color-scheme: dark)')
const isSystemDark = signal(system.matches)
system.addEventListener('change', () => (isSystemDark.value = system.matches))

export const isDark = computed(() => (theme.value === 'system' ? isSystemDark.value : theme.value === 'dark'))

export function nextTheme() {
  theme.value = THEMES[(THEMES.indexOf(theme.value) + 1) % THEMES.length]
  localStorage.setItem('theme', theme.value)
}
